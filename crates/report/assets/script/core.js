// Common to the scripts of pages with data: tables, helpers, and the filter of presses. Runs after the script of all pages.
// No dependencies.
const report = (() => {
  const $ = (q, from = document) => from.querySelector(q);
  const $$ = (q, from = document) => [...from.querySelectorAll(q)];
  const data = JSON.parse($('#report-data').textContent);
  // A column is an array, or runs of equal cells [value, count, ...], or steps from cell to cell in units of 1 / `per`.
  const unpacked = c => {
    if (Array.isArray(c)) return c;
    if (c.runs) return c.runs.flatMap((v, i) => i % 2 ? Array(v).fill(c.runs[i - 1]) : []);
    let sum = 0;
    return unpacked(c.steps).map(step => (sum += step) / c.per);
  };
  for (const t of Object.values(data.tables)) t.data = t.data.map(unpacked);
  const table = name => data.tables[name];
  const presses = table('presses') ?? { columns: [], data: [] };
  const C = Object.fromEntries(presses.columns.map((name, i) => [name, presses.data[i]]));
  const total = C.press?.length ?? 0;
  const rowOf = new Map(C.press?.map((press, i) => [press, i]));
  const text = (v, digits) => v === null || v === undefined ? '–' : digits === undefined ? String(v) : v.toFixed(digits);
  const el = (tag, content, cls) => {
    const e = document.createElement(tag);
    if (content !== undefined) e.textContent = content;
    if (cls) e.className = cls;
    return e;
  };
  const shape = (tag, attributes) => {
    const e = document.createElementNS('http://www.w3.org/2000/svg', tag);
    for (const [name, value] of Object.entries(attributes)) e.setAttribute(name, value);
    return e;
  };

  // A linear axis of a plot: ends of its data and of its pixels.
  const axis = (plot, name) => {
    const [from, to, start, end] = plot.dataset[name].split(' ').map(Number);
    return { from, to, start, end, at: v => start + (v - from) / (to - from) * (end - start) };
  };

  // The filter: wanted values by column, and who follows it.
  const wanted = new Map();
  const followers = [];
  const filter = {
    active: () => wanted.size > 0,
    passes: i => [...wanted].every(([column, w]) => String(C[column][i]) === w.value),
    words: () => [...wanted.values()].map(w => `${w.name} ${w.value}`).join(', '),
    // `each` is called now and after every change.
    follow: each => { followers.push(each); each(); },
    set: (column, name, value) => {
      if (value === '') wanted.delete(column); else wanted.set(column, { name, value });
      for (const each of followers) each();
    },
  };
  return { $, $$, data, table, C, total, rowOf, text, el, shape, axis, filter };
})();
