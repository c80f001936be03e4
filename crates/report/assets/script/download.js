// Downloads: every figure as SVG, its data as CSV, both without presses that the filter hides.
(() => {
  const { $, $$, data, table, rowOf, filter } = report;
  const save = (name, type, content) => {
    const url = URL.createObjectURL(new Blob([content], { type }));
    const a = document.createElement('a');
    a.href = url;
    a.download = (data.session + '_' + name).replace(/[^A-Za-z0-9._-]+/g, '-');
    a.click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
  };
  // A text that a spreadsheet would take for a formula gets a ' before it; numbers stay numbers.
  const text = v => typeof v === 'string' && /^[=+\-@\t\r\n\uff1d\uff0b\uff0d\uff20]/.test(v) ? "'" + v : v;
  const cell = w => plain(text(w));
  const plain = v => v === null || v === undefined ? '' : /[",\r\n]/.test(v) ? '"' + String(v).replaceAll('"', '""') + '"' : String(v);
  const csv = t => {
    const press = filter.active() ? t.data[t.columns.indexOf('press')] : undefined;
    const rows = t.data.length ? [...t.data[0].keys()] : [];
    const kept = press ? rows.filter(i => filter.passes(rowOf.get(press[i]))) : rows;
    const lines = [t.columns.join(','), ...kept.map(i => t.data.map(c => cell(c[i])).join(','))];
    return lines.join('\r\n') + '\r\n';
  };
  const svgFile = svg => {
    const copy = svg.cloneNode(true);
    const style = document.createElementNS(svg.namespaceURI, 'style');
    style.textContent = $('#figure-style').textContent;
    copy.insertBefore(style, copy.firstChild);
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + new XMLSerializer().serializeToString(copy);
  };
  for (const button of $$('[data-save]')) {
    button.addEventListener('click', () => {
      const box = button.closest('[data-figure]');
      const svg = $('.fig', box);
      const t = table(box.dataset.table);
      const followed = button.dataset.save === 'svg' ? $('[data-presses],.ecdf', svg) : t.columns.includes('press');
      const name = box.dataset.figure + (filter.active() && followed ? '_filtered' : '');
      if (button.dataset.save === 'svg') save(name + '.svg', 'image/svg+xml', svgFile(svg));
      else save(name + '.csv', 'text/csv', csv(t));
    });
  }
})();
