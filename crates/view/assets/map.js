// The skin from above: presses coloured by error, their rays, and the chosen one. Arrow keys move from press to press.
import { number, shape } from '/app/dom.js';
const colour = p => p.error_mm !== null && p.error_mm !== undefined ? `hsl(${Math.max(0, 200 - 40 * p.error_mm)} 70% 45%)`
  : p.verdict ? `var(--${p.verdict})` : 'transparent';
export const skinMap = (outline, cameras, choose) => {
  const xs = [...outline, ...cameras].map(p => p[0]), ys = [...outline, ...cameras].map(p => p[1]);
  const [left, right, low, high] = [Math.min(...xs) - 5, Math.max(...xs) + 5, Math.min(...ys) - 5, Math.max(...ys) + 5];
  const points = outline.map(([x, y]) => `${x},${-y}`).join(' ');
  const dots = shape('g'), marks = shape('g');
  const svg = shape('svg', { class: 'fig', viewBox: `${left} ${-high} ${right - left} ${high - low}`, role: 'group', tabindex: 0,
    'aria-label': 'Skin map: arrow keys move from press to press' },
  shape('polygon', { class: 'skin', points, 'stroke-width': 0.4, style: null }), dots, marks);
  let presses = [], at = -1;
  const select = n => { at = n; choose(presses[n]); };
  const draw = rows => {
    presses = rows;
    dots.replaceChildren(...rows.map((p, n) => {
      const [x, y] = p.truth_mm ?? p.at_mm;
      const dot = shape('circle', { class: 'press', cx: x, cy: -y, r: 1.3, fill: colour(p), stroke: 'var(--mark)', 'stroke-width': 0.3 });
      dot.append(shape('title', {}, `press ${p.press}: ${p.verdict ?? 'to do'}, error ${number(p.error_mm)} mm`));
      dot.addEventListener('click', () => select(n));
      return dot;
    }));
  };
  const mark = (press, tip) => {
    const parts = [];
    for (const [k, view] of (press?.views ?? []).entries()) {
      if (!view?.ray) continue;
      const [x, y] = cameras[k], [dx, dy] = view.ray;
      parts.push(shape('line', { class: `c${k + 1}`, x1: x, y1: -y, x2: x + 150 * dx, y2: -(y + 150 * dy), 'stroke-width': 0.5 }));
    }
    if (press) { const [x, y] = press.truth_mm ?? press.at_mm; parts.push(shape('circle', { cx: x, cy: -y, r: 2.4, fill: 'none', stroke: 'var(--hi)', 'stroke-width': 0.6 })); }
    if (press?.estimate_mm) parts.push(shape('circle', { cx: press.estimate_mm[0], cy: -press.estimate_mm[1], r: 0.9, fill: 'var(--hi)' }));
    if (tip) parts.push(shape('circle', { cx: tip[0], cy: -tip[1], r: 1.2, fill: 'none', stroke: 'var(--ink)', 'stroke-width': 0.5 }));
    marks.replaceChildren(...parts);
  };
  svg.addEventListener('keydown', event => {
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (!step || !presses.length) return;
    event.preventDefault();
    select((at + step + presses.length) % presses.length);
  });
  return { svg, draw, mark };
};
