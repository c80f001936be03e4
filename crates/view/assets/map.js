// The skin from above: presses coloured by error, the rays of the chosen one and where they meet. Arrow keys move from press to press.
import { number, shape } from '/app/dom.js';
const FAR_MM = 150;
const colour = p => p.error_mm !== null && p.error_mm !== undefined ? `hsl(${Math.max(0, 200 - 40 * p.error_mm)} 70% 45%)`
  : p.verdict ? `var(--${p.verdict})` : 'transparent';
const place = p => p.truth_mm ?? p.at_mm;
// Both ends of each ray of a press.
export const rays = (press, cameras) => (press?.views ?? []).map((view, k) => {
  if (!view?.ray) return null;
  const [x, y] = cameras[k], [dx, dy] = view.ray;
  return [x, y, x + FAR_MM * dx, y + FAR_MM * dy];
});
// Left, top, width and height that hold the outline and the cameras; y grows downwards.
export const extent = (outline, cameras) => {
  const xs = [...outline, ...cameras].map(p => p[0]), ys = [...outline, ...cameras].map(p => -p[1]);
  const [left, top] = [Math.min(...xs) - 5, Math.min(...ys) - 5];
  return [left, top, Math.max(...xs) + 5 - left, Math.max(...ys) + 5 - top];
};
export const skinMap = (outline, cameras, choose) => {
  const points = outline.map(([x, y]) => `${x},${-y}`).join(' ');
  const dots = shape('g'), marks = shape('g');
  const svg = shape('svg', { class: 'fig', viewBox: extent(outline, cameras).join(' '), role: 'group', tabindex: 0,
    'aria-label': 'Skin map: arrow keys move from press to press' },
  shape('polygon', { class: 'skin', points, 'stroke-width': 0.4, style: null }), dots, marks,
  ...cameras.map(([x, y], k) => shape('circle', { class: `f${k + 1}`, cx: x, cy: -y, r: 1.6 })));
  let presses = [], at = -1;
  const select = n => { at = n; choose(presses[n]); };
  const draw = rows => {
    presses = rows;
    dots.replaceChildren(...rows.map((p, n) => {
      const [x, y] = place(p);
      const dot = shape('circle', { class: 'press', cx: x, cy: -y, r: 1.3, fill: colour(p), stroke: 'var(--mark)', 'stroke-width': 0.3 });
      dot.append(shape('title', {}, `press ${p.press}: ${p.verdict ?? 'to do'}, error ${number(p.error_mm)} mm`));
      dot.addEventListener('click', () => select(n));
      return dot;
    }));
  };
  const mark = (press, tip, touch) => {
    const parts = rays(press, cameras).map((ray, k) => ray && shape('line', { class: `ray c${k + 1}`, x1: ray[0], y1: -ray[1], x2: ray[2], y2: -ray[3] }));
    at = presses.indexOf(press);
    if (press) {
      const [x, y] = place(press);
      parts.push(shape('circle', { class: 'chosen', cx: x, cy: -y, r: 2.4 }));
      if (press.estimate_mm) {
        const [u, v] = press.estimate_mm;
        parts.push(shape('line', { class: 'miss', x1: x, y1: -y, x2: u, y2: -v }),
          shape('circle', { class: 'meeting', cx: u, cy: -v, r: 0.9 }, shape('title', {}, `rays meet ${number(press.error_mm)} mm from the press`)));
      }
    }
    if (touch) {
      const [x, y] = touch.at_mm, { semi_axes_mm: [rx, ry], angle_deg: angle } = touch.region ?? { semi_axes_mm: [1, 1], angle_deg: 0 };
      parts.push(shape('ellipse', { class: 'felt', cx: x, cy: -y, rx, ry, transform: `rotate(${-angle} ${x} ${-y})` },
        shape('title', {}, touch.region ? 'felt here: 95 % region' : 'felt here, without a region')));
    }
    if (tip) parts.push(shape('circle', { class: 'tip', cx: tip[0], cy: -tip[1], r: 1.2 }));
    marks.replaceChildren(...parts.filter(Boolean));
  };
  svg.addEventListener('keydown', event => {
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (!step || !presses.length) return;
    event.preventDefault();
    select((at + step + presses.length) % presses.length);
  });
  return { svg, draw, mark };
};
