// The skin map: layers, and the numbers of the press that is pointed at or chosen with the arrow keys.
(() => {
  const { $, $$, C, total, text, el, shape, filter } = report;
  const map = $('#skin-map');
  for (const box of $$('[data-layer]')) {
    box.addEventListener('change', () => $('.layer-' + box.dataset.layer, map).classList.toggle('off-layer', !box.checked));
  }
  const [xAxis, yAxis] = ['x', 'y'].map(name => report.axis($('.plot', map), name));
  const px = (x, y) => [xAxis.at(x), yAxis.at(y)];
  let shown = [];
  filter.follow(() => { shown = [...Array(total).keys()].filter(i => C.role[i] === 'score' && filter.passes(i)); });
  const place = i => C.truth_x_mm[i] === null ? px(C.planned_x_mm[i], C.planned_y_mm[i]) : px(C.truth_x_mm[i], C.truth_y_mm[i]);
  const guess = i => C.estimate_x_mm[i] === null ? null : px(C.estimate_x_mm[i], C.estimate_y_mm[i]);
  const selection = $('.selection', map);
  const inspect = $('#inspect');
  let kept = null;
  let current = null;
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
      selection.append(shape('circle', { class: 'select', cx: tx, cy: ty, r: 8 }));
      const e = guess(i);
      if (e) {
        selection.append(
          shape('line', { class: 'select', x1: tx, y1: ty, x2: e[0], y2: e[1] }),
          shape('circle', { class: 'select', cx: e[0], cy: e[1], r: 3.5 }),
        );
      }
    }
    const row = (name, value) => inspect.append(el('dt', name), el('dd', value));
    row('press', text(C.press[i]));
    row('role', C.role[i]);
    row('repetition', text(C.repetition[i]));
    row('location', text(C.location[i]));
    row('depth (mm)', text(C.depth_mm[i]));
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
  map.addEventListener('pointermove', e => { if (kept === null) select(nearest(e)); });
  map.addEventListener('pointerleave', () => { if (kept === null) select(null); });
  map.addEventListener('click', e => { kept = nearest(e); select(kept); });
  mapCanvas.addEventListener('keydown', e => {
    if (!shown.length) return;
    const at = shown.indexOf(current);
    const next = { ArrowRight: at + 1, ArrowDown: at + 1, ArrowLeft: at - 1, ArrowUp: at - 1, Home: 0, End: shown.length - 1 }[e.key];
    if (e.key === 'Escape') { kept = null; select(null); return; }
    if (next === undefined) return;
    e.preventDefault();
    kept = shown[(next + shown.length) % shown.length];
    select(kept);
  });
  report.keep = i => { kept = i; select(i); };
})();
