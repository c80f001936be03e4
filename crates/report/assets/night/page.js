// Behaviour of the page of a night: everything open or closed. Stands after the script of all pages. No dependencies.
(() => {
  const all = [...document.querySelectorAll('details.check')];
  document.querySelector('#all').addEventListener('click', () => { const open = all.some(d => !d.open); for (const d of all) d.open = open; });
  // A link to a check opens it.
  const show = () => { const d = document.getElementById(location.hash.slice(1)); if (d && d.matches('details')) d.open = true; };
  addEventListener('hashchange', show);
  show();
  addEventListener('beforeprint', () => { for (const d of all) { d.dataset.was = d.open; d.open = true; } });
  addEventListener('afterprint', () => { for (const d of all) d.open = d.dataset.was === 'true'; });
})();
