// Event rates: zoom and move along time, by buttons, keys, wheel and dragging.
(() => {
  const { $, $$, shape } = report;
  const rates = $('#event-rates');
  const { from: t0, to: t1, start: x0, end: x1 } = report.axis($('.plot', rates), 'x');
  const width = x1 - x0;
  let view = [t0, t1];
  const axes = $$('.x-ticks', rates).filter(g => g.querySelector('line')).map(g => {
    const line = $('line', g);
    return { g, top: line.getAttribute('y1'), bottom: line.getAttribute('y2'), label: $('text', g).getAttribute('y'), dy: $('text', g).getAttribute('dy') };
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
    for (const { g, top, bottom, label, dy } of axes) {
      g.replaceChildren();
      for (let i = Math.ceil(a / step - 1e-9); i * step <= b * (1 + 1e-12); i++) {
        const x = x0 + (i * step - a) / (b - a) * width;
        const line = shape('line', { class: 'grid', x1: x, x2: x, y1: top, y2: bottom });
        const tick = shape('text', { class: 'tick', x, y: label, dy, 'text-anchor': 'middle' });
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
})();
