// Behaviour of the page of a night: theme, print, everything open or closed. No dependencies.
'use strict';
(() => {
  const $ = q => document.querySelector(q);
  const root = document.documentElement;
  const button = $('#theme');
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
  const all = [...document.querySelectorAll('details.check')];
  $('#all').addEventListener('click', () => { const open = all.some(d => !d.open); for (const d of all) d.open = open; });
  // A link to a check opens it.
  const show = () => { const d = document.getElementById(location.hash.slice(1)); if (d && d.matches('details')) d.open = true; };
  addEventListener('hashchange', show);
  show();
  let before;
  addEventListener('beforeprint', () => { before = root.dataset.theme; root.dataset.theme = 'light'; for (const d of all) { d.dataset.was = d.open; d.open = true; } });
  addEventListener('afterprint', () => { if (before) root.dataset.theme = before; else delete root.dataset.theme; for (const d of all) d.open = d.dataset.was === 'true'; });
  $('#print').addEventListener('click', () => print());
})();
