// Behaviour of the report page: theme, downloads, map selection, time zoom, press table. No dependencies.
'use strict';
(() => {
  const $ = (q, from = document) => from.querySelector(q);
  const $$ = (q, from = document) => [...from.querySelectorAll(q)];
  const SVG = 'http://www.w3.org/2000/svg';
  const data = JSON.parse($('#report-data').textContent);
  // A column is an array, or runs of equal cells: [value, count, value, count, ...].
  const unpacked = c => Array.isArray(c) ? c : c.runs.flatMap((v, i) => i % 2 ? Array(v).fill(c.runs[i - 1]) : []);
  for (const t of Object.values(data.tables)) t.data = t.data.map(unpacked);
  const table = name => data.tables[name];
  const column = (t, name) => t.data[t.columns.indexOf(name)];
  const P = table('presses');
  const C = Object.fromEntries(P.columns.map((name, i) => [name, P.data[i]]));
  const total = C.press.length;
  const text = (v, digits) => v === null || v === undefined ? '–' : digits === undefined ? String(v) : v.toFixed(digits);
  const el = (tag, content, cls) => {
    const e = document.createElement(tag);
    if (content !== undefined) e.textContent = content;
    if (cls) e.className = cls;
    return e;
  };

  // Theme: follows the system until the button is used.
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

  // Downloads.
  const save = (name, type, content) => {
    const url = URL.createObjectURL(new Blob([content], { type }));
    const a = el('a');
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
  const svgFile = svg => {
    const copy = svg.cloneNode(true);
    const style = document.createElementNS(SVG, 'style');
    style.textContent = $('#figure-style').textContent;
    copy.insertBefore(style, copy.firstChild);
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + new XMLSerializer().serializeToString(copy);
  };
  for (const button of $$('[data-save]')) {
    button.addEventListener('click', () => {
      const box = button.closest('[data-figure]');
      const name = box.dataset.figure;
      if (button.dataset.save === 'svg') save(name + '.svg', 'image/svg+xml', svgFile($('svg', box)));
      else save(name + '.csv', 'text/csv', csv(table(box.dataset.table)));
    });
  }

  // Skin map: layers, hover, keyboard.
  const map = $('#skin-map');
  for (const box of $$('[data-layer]')) {
    box.addEventListener('change', () => $('.layer-' + box.dataset.layer, map).classList.toggle('off-layer', !box.checked));
  }
  const [ox, oy, k] = ['ox', 'oy', 'k'].map(name => Number(map.dataset[name]));
  const px = (x, y) => [ox + k * x, oy - k * y];
  const shown = [];
  for (let i = 0; i < total; i++) if (C.role[i] === 'score') shown.push(i);
  const place = i => C.truth_x_mm[i] === null ? px(C.planned_x_mm[i], C.planned_y_mm[i]) : px(C.truth_x_mm[i], C.truth_y_mm[i]);
  const guess = i => C.estimate_x_mm[i] === null ? null : px(C.estimate_x_mm[i], C.estimate_y_mm[i]);
  const selection = $('.selection', map);
  const inspect = $('#inspect');
  let pinned = null;
  let current = null;
  const shape = (tag, attributes) => {
    const e = document.createElementNS(SVG, tag);
    for (const [name, value] of Object.entries(attributes)) e.setAttribute(name, value);
    selection.append(e);
  };
  const pair = (a, b, i, digits) => C[a][i] === null ? '–' : `${text(C[a][i], digits)}, ${text(C[b][i], digits)}`;
  const select = i => {
    if (i === current) return;
    current = i;
    selection.replaceChildren();
    inspect.replaceChildren();
    $('#inspect-hint').hidden = i !== null;
    if (i === null) return;
    if (C.role[i] === 'score') {
      const [tx, ty] = place(i);
      shape('circle', { class: 'select', cx: tx, cy: ty, r: 8 });
      const e = guess(i);
      if (e) {
        shape('line', { class: 'select', x1: tx, y1: ty, x2: e[0], y2: e[1] });
        shape('circle', { class: 'select', cx: e[0], cy: e[1], r: 3.5 });
      }
    }
    const row = (name, value) => inspect.append(el('dt', name), el('dd', value));
    row('press', text(C.press[i]));
    row('role', C.role[i]);
    row('repetition', text(C.repetition[i]));
    row('location', text(C.location[i]));
    row('verdict', C.verdict[i]);
    if (C.reason[i]) row('reason', C.reason[i]);
    row('outcome', C.outcome[i]);
    row('planned (mm)', pair('planned_x_mm', 'planned_y_mm', i, 2));
    row('truth (mm)', pair('truth_x_mm', 'truth_y_mm', i, 2));
    row('estimate (mm)', pair('estimate_x_mm', 'estimate_y_mm', i, 2));
    row('error x, y (mm)', pair('error_x_mm', 'error_y_mm', i, 2));
    row('error (mm)', text(C.error_mm[i], 2));
    for (const c of [1, 2]) {
      inspect.append(el('dt', 'camera ' + c, 'head'));
      row('events', text(C[`camera${c}_events`][i]));
      row('of them ON', text(C[`camera${c}_on_events`][i]));
      row('clusters', text(C[`camera${c}_clusters`][i]));
      row('centroid u, v (px)', pair(`camera${c}_centroid_u_px`, `camera${c}_centroid_v_px`, i, 1));
    }
  };
  const nearest = event => {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(map.getScreenCTM().inverse());
    let best = null;
    let least = 14 * 14;
    for (const i of shown) {
      for (const q of [place(i), guess(i)]) {
        if (!q) continue;
        const d = (q[0] - at.x) ** 2 + (q[1] - at.y) ** 2;
        if (d < least) { least = d; best = i; }
      }
    }
    return best;
  };
  const mapCanvas = map.parentElement;
  map.addEventListener('pointermove', e => { if (pinned === null) select(nearest(e)); });
  map.addEventListener('pointerleave', () => { if (pinned === null) select(null); });
  map.addEventListener('click', e => { pinned = nearest(e); select(pinned); });
  mapCanvas.addEventListener('keydown', e => {
    if (!shown.length) return;
    const at = shown.indexOf(current);
    const next = { ArrowRight: at + 1, ArrowDown: at + 1, ArrowLeft: at - 1, ArrowUp: at - 1, Home: 0, End: shown.length - 1 }[e.key];
    if (e.key === 'Escape') { pinned = null; select(null); return; }
    if (next === undefined) return;
    e.preventDefault();
    pinned = shown[(next + shown.length) % shown.length];
    select(pinned);
  });

  // Event rates: zoom and move along time.
  const rates = $('#event-rates');
  const [t0, t1, x0, x1] = ['t0', 't1', 'x0', 'x1'].map(name => Number(rates.dataset[name]));
  const width = x1 - x0;
  let view = [t0, t1];
  const axes = $$('.x-ticks', rates).filter(g => g.querySelector('line')).map(g => {
    const line = $('line', g);
    return { g, top: line.getAttribute('y1'), bottom: line.getAttribute('y2'), label: $('text', g).getAttribute('y') };
  });
  const drawTime = () => {
    const [a, b] = view;
    const scale = (t1 - t0) / (b - a);
    const shift = x0 - scale * x0 + (t0 - a) / (b - a) * width;
    for (const g of $$('.zoomed', rates)) g.setAttribute('transform', `translate(${shift} 0) scale(${scale} 1)`);
    const raw = (b - a) / 10;
    const power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map(m => m * power).find(s => s >= raw * 0.999);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    for (const { g, top, bottom, label } of axes) {
      g.replaceChildren();
      for (let i = Math.ceil(a / step - 1e-9); i * step <= b * (1 + 1e-12); i++) {
        const x = x0 + (i * step - a) / (b - a) * width;
        const line = document.createElementNS(SVG, 'line');
        for (const [n, v] of Object.entries({ class: 'grid', x1: x, x2: x, y1: top, y2: bottom })) line.setAttribute(n, v);
        const tick = document.createElementNS(SVG, 'text');
        for (const [n, v] of Object.entries({ class: 'tick', x, y: label, 'text-anchor': 'middle' })) tick.setAttribute(n, v);
        tick.textContent = (i * step).toFixed(digits);
        g.append(line, tick);
      }
    }
    const decimals = Math.max(1, digits);
    const seconds = t => `${(Math.abs(t) < 0.5 * 10 ** -decimals ? 0 : t).toFixed(decimals)} s`; // never "-0.0 s"
    $('#zoom-range').textContent = `${seconds(a)} to ${seconds(b)}`;
  };
  const zoomTo = (a, b) => {
    const span = Math.min(Math.max(b - a, Math.min(0.2, t1 - t0)), t1 - t0);
    const start = Math.min(Math.max((a + b - span) / 2, t0), t1 - span);
    view = [start, start + span];
    drawTime();
  };
  const zoom = (factor, about = (view[0] + view[1]) / 2) => zoomTo(about - (about - view[0]) * factor, about + (view[1] - about) * factor);
  const move = share => { const d = share * (view[1] - view[0]); const a = Math.min(Math.max(view[0] + d, t0), t1 - (view[1] - view[0])); zoomTo(a, a + view[1] - view[0]); };
  const actions = { in: () => zoom(0.5), out: () => zoom(2), left: () => move(-0.25), right: () => move(0.25), reset: () => zoomTo(t0, t1) };
  for (const b of $$('[data-zoom]')) b.addEventListener('click', () => actions[b.dataset.zoom]());
  const rateCanvas = rates.parentElement;
  rateCanvas.addEventListener('keydown', e => {
    const action = { '+': 'in', '=': 'in', '-': 'out', ArrowLeft: 'left', ArrowRight: 'right', '0': 'reset' }[e.key];
    if (action) { e.preventDefault(); actions[action](); }
  });
  const timeAt = e => {
    const at = new DOMPoint(e.clientX, e.clientY).matrixTransform(rates.getScreenCTM().inverse());
    return view[0] + (at.x - x0) / width * (view[1] - view[0]);
  };
  rateCanvas.addEventListener('dblclick', e => zoom(0.4, timeAt(e)));
  rateCanvas.addEventListener('wheel', e => {
    if (!e.ctrlKey && !e.shiftKey && document.activeElement !== rateCanvas) return;
    e.preventDefault();
    zoom((e.deltaY || e.deltaX) > 0 ? 1.25 : 0.8, timeAt(e));
  }, { passive: false });
  let grabbed = null;
  rateCanvas.addEventListener('pointerdown', e => { grabbed = timeAt(e); rateCanvas.setPointerCapture(e.pointerId); rateCanvas.classList.add('drag'); });
  rateCanvas.addEventListener('pointermove', e => {
    if (grabbed === null) return;
    move((grabbed - timeAt(e)) / (view[1] - view[0]));
  });
  const release = () => { grabbed = null; rateCanvas.classList.remove('drag'); };
  rateCanvas.addEventListener('pointerup', release);
  rateCanvas.addEventListener('pointercancel', release);
  if (axes.length) drawTime();

  // Press table: filter, sort, one page at a time.
  const PAGE = 50;
  const columns = [
    ['press', 'press', 0], ['role', 'role'], ['repetition', 'rep.', 0], ['location', 'location', 0], ['verdict', 'verdict'], ['outcome', 'outcome'],
    ['truth_x_mm', 'truth x (mm)', 2], ['truth_y_mm', 'truth y (mm)', 2], ['estimate_x_mm', 'estimate x (mm)', 2], ['estimate_y_mm', 'estimate y (mm)', 2],
    ['error_mm', 'error (mm)', 2], ['camera1_events', 'events 1', 0], ['camera2_events', 'events 2', 0],
    ['camera1_clusters', 'clusters 1', 0], ['camera2_clusters', 'clusters 2', 0],
    ['camera1_centroid_u_px', 'u 1 (px)', 1], ['camera2_centroid_u_px', 'u 2 (px)', 1], ['reason', 'reason'],
  ];
  const pressTable = $('#press-table');
  const body = $('tbody', pressTable);
  let sort = { key: 'press', down: false };
  let page = 0;
  let rows = [];
  const headRow = el('tr');
  for (const [key, name] of columns) {
    const th = el('th');
    th.scope = 'col';
    th.dataset.key = key;
    const button = el('button', name);
    button.type = 'button';
    button.addEventListener('click', () => { sort = { key, down: sort.key === key && !sort.down }; page = 0; refresh(); });
    th.append(button);
    headRow.append(th);
  }
  $('thead', pressTable).append(headRow);
  for (const input of $$('[data-filter]')) {
    if (input.tagName === 'SELECT') {
      const values = [...new Set(C[input.dataset.filter])].sort((a, b) => typeof a === 'number' ? a - b : a < b ? -1 : 1);
      for (const v of values) { const option = el('option', String(v)); option.value = String(v); input.append(option); }
    }
    input.addEventListener('input', () => { page = 0; refresh(); });
  }
  $('#filters').addEventListener('submit', e => e.preventDefault());
  const refresh = () => {
    const filters = $$('[data-filter]').filter(i => i.value !== '').map(i => [C[i.dataset.filter], i.value]);
    rows = [];
    for (let i = 0; i < total; i++) if (filters.every(([c, v]) => String(c[i]) === v)) rows.push(i);
    const c = C[sort.key];
    const sign = sort.down ? -1 : 1;
    rows.sort((a, b) => {
      if (c[a] === c[b]) return a - b;
      if (c[a] === null) return 1;
      if (c[b] === null) return -1;
      return sign * (c[a] < c[b] ? -1 : 1);
    });
    for (const th of headRow.children) {
      const mine = th.dataset.key === sort.key;
      if (mine) th.setAttribute('aria-sort', sort.down ? 'descending' : 'ascending'); else th.removeAttribute('aria-sort');
      const button = th.firstChild;
      button.textContent = button.textContent.replace(/ [▲▼]$/, '') + (mine ? (sort.down ? ' ▼' : ' ▲') : '');
    }
    show();
  };
  const show = () => {
    const pages = Math.max(1, Math.ceil(rows.length / PAGE));
    page = Math.min(Math.max(page, 0), pages - 1);
    body.replaceChildren(...rows.slice(page * PAGE, (page + 1) * PAGE).map(i => {
      const tr = el('tr');
      for (const [key, , digits] of columns) {
        const value = C[key][i];
        if (key === 'press') {
          const th = el('th');
          const button = el('button', text(value));
          th.scope = 'row';
          button.type = 'button';
          button.setAttribute('aria-label', `Show press ${value}`);
          th.append(button);
          tr.append(th);
          continue;
        }
        const td = el('td', value === null && digits === undefined ? '' : text(value, digits), digits === undefined ? (key === 'reason' ? 'reason' : '') : 'num');
        if (key === 'verdict') td.prepend(el('i', '', 'key ' + (/^[a-z]+$/.test(value) ? value : '')));
        tr.append(td);
      }
      tr.addEventListener('click', () => {
        for (const other of body.children) other.removeAttribute('aria-selected');
        tr.setAttribute('aria-selected', 'true');
        pinned = i;
        select(i);
      });
      return tr;
    }));
    $('#page-state').textContent = rows.length ? `${page * PAGE + 1} to ${Math.min((page + 1) * PAGE, rows.length)} of ${rows.length} presses` : 'no press matches';
    $('[data-page="-1"]').disabled = page === 0;
    $('[data-page="1"]').disabled = page === pages - 1;
  };
  for (const b of $$('[data-page]')) b.addEventListener('click', () => { page += Number(b.dataset.page); show(); });
  refresh();
})();
