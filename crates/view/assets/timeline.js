// A strip of session time: event rates, presses, clock marks, touches felt, notes, and the time that is shown. A click goes to a time.
import { shape } from '/app/dom.js';
const WIDTH = 1000, HEIGHT = 64;
const path = (ticks, x, y0, y1) => ticks.filter(t => x(t) >= 0 && x(t) <= WIDTH).map(t => `M${x(t).toFixed(1)} ${y0}V${y1}`).join('');
const curve = (rates, x, s, most) => rates.map((rate, n) => {
  const t = s.span_s[1] * (n + 0.5) / rates.length;
  return `${n ? 'L' : 'M'}${x(t).toFixed(1)} ${(HEIGHT - 16 - 30 * rate / most).toFixed(1)}`;
}).join('');
export const timeline = (label, go) => {
  const parts = shape('g'), cursor = shape('path', { class: 'cursor', 'vector-effect': 'non-scaling-stroke' });
  const svg = shape('svg', { class: 'fig strip', viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: 'none', role: 'img', 'aria-label': label }, parts, cursor);
  let from = 0, to = 1;
  const x = t => WIDTH * (t - from) / (to - from || 1);
  const line = (cls, d) => shape('path', { class: cls, d, 'vector-effect': 'non-scaling-stroke' });
  svg.addEventListener('click', event => {
    const box = svg.getBoundingClientRect();
    go(from + (to - from) * (event.clientX - box.left) / box.width);
  });
  const presses = rows => ['valid', 'missed', 'invalid', 'excluded'].map(verdict => shape('path', { class: 'verdict', style: null, fill: `var(--${verdict})`,
    d: rows.filter(p => p.verdict === verdict && p.times_s && p.times_s[5] >= from && p.times_s[0] <= to)
      .map(p => `M${x(p.times_s[1]).toFixed(1)} ${HEIGHT - 12}H${Math.max(x(p.times_s[4]), x(p.times_s[1]) + 1).toFixed(1)}V${HEIGHT - 4}H${x(p.times_s[1]).toFixed(1)}z`).join('') }));
  return {
    svg,
    // Everything between two times; `phases`: times of one press.
    draw: (s, rows, interval, phases) => {
      [from, to] = interval;
      const most = Math.max(1, ...s.rates.flat());
      parts.replaceChildren(
        ...phases ? [line('phase', path(phases, x, 4, HEIGHT))] : s.rates.map((rates, k) => line(`line c${k + 1}`, curve(rates, x, s, most))),
        ...presses(rows),
        line('clock', path(s.marks.map(m => m[0]), x, 0, 12)),
        line('felt', path(s.touches.filter(row => row[1] === 'onset').map(row => row[0]), x, HEIGHT - 18, HEIGHT)),
        line('said', path([...s.notes, ...s.interruptions].map(n => n[0]), x, 0, HEIGHT)));
    },
    at: t => cursor.setAttribute('d', t >= from && t <= to ? `M${x(t).toFixed(1)} 0V${HEIGHT}` : ''),
  };
};
