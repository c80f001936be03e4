// Light and dark, and printing: always light.
(() => {
  const { $ } = report;
  const root = document.documentElement;
  const themeButton = $('#theme');
  const systemDark = matchMedia('(prefers-color-scheme: dark)');
  const isDark = () => (root.dataset.theme || (systemDark.matches ? 'dark' : 'light')) === 'dark';
  const labelTheme = () => { themeButton.textContent = isDark() ? 'Light' : 'Dark'; };
  const store = value => { try { localStorage.setItem('skinrig-theme', value); } catch { /* a page may be denied storage */ } };
  try { const kept = localStorage.getItem('skinrig-theme'); if (kept === 'dark' || kept === 'light') root.dataset.theme = kept; } catch { /* same */ }
  const asked = location.hash.match(/theme=(dark|light)/);
  if (asked) root.dataset.theme = asked[1];
  themeButton.addEventListener('click', () => { root.dataset.theme = isDark() ? 'light' : 'dark'; store(root.dataset.theme); labelTheme(); });
  systemDark.addEventListener('change', labelTheme);
  labelTheme();
  let themeBeforePrint;
  addEventListener('beforeprint', () => { themeBeforePrint = root.dataset.theme; root.dataset.theme = 'light'; });
  addEventListener('afterprint', () => { if (themeBeforePrint) root.dataset.theme = themeBeforePrint; else delete root.dataset.theme; });
  $('#print').addEventListener('click', () => print());
})();
