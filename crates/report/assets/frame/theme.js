// What every page does, before its own script: light and dark (the system's, what was chosen last, or #theme=dark in the address), and
// printing, which is always light; on a phone, the parts of figures one below the other. No dependencies.
'use strict';
(() => {
  const root = document.documentElement;
  const button = document.querySelector('#theme');
  const systemDark = matchMedia('(prefers-color-scheme: dark)');
  const isDark = () => (root.dataset.theme || (systemDark.matches ? 'dark' : 'light')) === 'dark';
  const label = () => { button.textContent = isDark() ? 'Light' : 'Dark'; };
  const store = value => { try { localStorage.setItem('skinrig-theme', value); } catch { /* a page may be denied storage */ } };
  try { const kept = localStorage.getItem('skinrig-theme'); if (kept === 'dark' || kept === 'light') root.dataset.theme = kept; } catch { /* same */ }
  const asked = location.hash.match(/theme=(dark|light)/);
  if (asked) root.dataset.theme = asked[1];
  button.addEventListener('click', () => { root.dataset.theme = isDark() ? 'light' : 'dark'; store(root.dataset.theme); label(); });
  systemDark.addEventListener('change', label);
  label();
  let beforePrint;
  addEventListener('beforeprint', () => { beforePrint = root.dataset.theme; root.dataset.theme = 'light'; });
  addEventListener('afterprint', () => { if (beforePrint) root.dataset.theme = beforePrint; else delete root.dataset.theme; });
  document.querySelector('#print').addEventListener('click', () => print());
})();
(() => {
  const phone = matchMedia('screen and (max-width:640px)');
  const arrange = () => {
    for (const svg of document.querySelectorAll('svg[data-narrow]')) {
      svg.dataset.wide ??= svg.getAttribute('viewBox');
      svg.setAttribute('viewBox', phone.matches ? svg.dataset.narrow : svg.dataset.wide);
      svg.classList.toggle('narrow', phone.matches);
      svg.style.setProperty('--texts', phone.matches ? svg.dataset.texts : 1);
      for (const part of svg.querySelectorAll('[data-to]')) {
        if (phone.matches) part.setAttribute('transform', `translate(${part.dataset.to})`);
        else part.removeAttribute('transform');
      }
    }
  };
  phone.addEventListener('change', arrange);
  arrange();
})();
