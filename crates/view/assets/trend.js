// RMSE of one prototype over its sessions, oldest first, with 95 % intervals; each point links to its session.
import { address } from '/app/api.js';
import { el, fileName, number, shape } from '/app/dom.js';
const WIDTH = 420, HEIGHT = 120, LEFT = 34, BOTTOM = 18;
export const trend = (prototype, series) => {
  const points = series.points.filter(p => typeof p.rmse_mm?.value === 'number');
  const without = series.points.length - points.length;
  const values = points.flatMap(p => [p.rmse_mm.value, p.rmse_mm.low, p.rmse_mm.high]).filter(v => typeof v === 'number');
  const most = Math.max(...values, 0) * 1.1 || 1;
  const x = n => LEFT + (WIDTH - LEFT - 10) * (points.length > 1 ? n / (points.length - 1) * 0.92 + 0.04 : 0.5);
  const y = v => HEIGHT - BOTTOM - (HEIGHT - BOTTOM - 8) * v / most;
  const text = (at, anchor, content) => shape('text', { class: 'tick', x: at[0], y: at[1], 'text-anchor': anchor }, content);
  const caption = `${prototype}, ${fileName(series.protocol)}, ${series.rig_kind}: ${points.length} ${points.length === 1 ? 'session' : 'sessions'}`
    + (points.length ? `, newest ${number(series.last?.value)} mm, best ${number(series.best?.value)} mm` : '') + (without ? `; ${without} without a result` : '');
  const svg = shape('svg', { class: 'fig', viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: 'group', 'aria-label': `RMSE over time (mm): ${caption}` },
    ...[0, most / 1.1].map(v => shape('path', { class: 'grid', d: `M${LEFT} ${y(v)}H${WIDTH - 10}` })),
    ...[0, most / 1.1].map(v => text([LEFT - 4, y(v) + 4], 'end', number(v, 1))),
    shape('path', { class: 'line c1', d: points.map((p, n) => `${n ? 'L' : 'M'}${x(n)} ${y(p.rmse_mm.value)}`).join('') }),
    ...points.map((p, n) => {
      const { value, low, high } = p.rmse_mm, said = `${p.started_at}: ${number(value)} mm (${number(low)} to ${number(high)})`;
      return shape('a', { href: address({ session: fileName(p.session) }), 'aria-label': said },
        shape('title', {}, said),
        typeof low === 'number' && typeof high === 'number' ? shape('path', { class: 'line c1', d: `M${x(n)} ${y(low)}V${y(high)}` }) : null,
        shape('circle', { class: 'f1', cx: x(n), cy: y(value), r: 4 }));
    }),
    points.length ? text([x(0), HEIGHT - 4], 'middle', points[0].started_at.slice(0, 10)) : '',
    points.length > 1 ? text([x(points.length - 1), HEIGHT - 4], 'end', points.at(-1).started_at.slice(0, 10)) : '');
  return el('figure', { class: 'trend' }, svg, el('figcaption', {}, caption));
};
