// Behaviour of the page of a comparison: downloads. Stands after the script of all pages. No dependencies.
(() => {
  const $ = (q, from = document) => from.querySelector(q);
  const $$ = (q, from = document) => [...from.querySelectorAll(q)];
  const data = JSON.parse($('#report-data').textContent);

  // Downloads.
  const save = (name, type, content) => {
    const url = URL.createObjectURL(new Blob([content], { type }));
    const a = document.createElement('a');
    a.href = url;
    a.download = (data.session + '_' + name).replace(/[^A-Za-z0-9._-]+/g, '-');
    a.click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
  };
  const cell = v => v === null || v === undefined ? '' : /[",\r\n]/.test(v) ? '"' + String(v).replaceAll('"', '""') + '"' : String(v);
  const csv = t => {
    const n = t.data.length ? t.data[0].length : 0;
    const lines = [t.columns.join(',')];
    for (let i = 0; i < n; i++) lines.push(t.data.map(c => cell(c[i])).join(','));
    return lines.join('\r\n') + '\r\n';
  };
  const file = svg => {
    const copy = svg.cloneNode(true);
    const style = document.createElementNS('http://www.w3.org/2000/svg', 'style');
    style.textContent = $('#figure-style').textContent;
    copy.insertBefore(style, copy.firstChild);
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + new XMLSerializer().serializeToString(copy);
  };
  for (const b of $$('[data-save]')) {
    b.addEventListener('click', () => {
      const box = b.closest('[data-figure]');
      const name = box.dataset.figure;
      if (b.dataset.save === 'svg') save(name + '.svg', 'image/svg+xml', file($('svg', box)));
      else save(name + '.csv', 'text/csv', csv(data.tables[box.dataset.table]));
    });
  }
})();
