// One session as it is played back: map, both cameras with clusters, clock marks and rays. Others decide about the time.
import { bytes, json } from '/app/api.js';
import { el, number, table } from '/app/dom.js';
import { skinMap } from '/app/map.js';
import { cameraPicture } from '/app/camera.js';
import { timeline } from '/app/timeline.js';
const height = mm => `${number(Math.abs(mm))} mm ${mm < 0 ? 'into' : 'above'} the skin`;
const MARK_S = 0.05;
const REACTIONS = ['stopped', 'lifted'];
// What the run felt at a time: the newest estimate of a touch that has not ended by then.
export const feltAt = (touches, t) => {
  const last = touches.findLast(row => row[0] <= t && !REACTIONS.includes(row[1]));
  return ['onset', 'position'].includes(last?.[1]) ? { at_mm: last[2], region: last[3], depth: last[4] } : null;
};
export const summary = a => !a ? 'not analysed: `skinrig analyze` measures the errors' : a.valid
  ? `${a.calibrated ? 'RMSE' : 'residual against the nominal geometry'} ${number(a.rmse_mm[0])} mm (${number(a.rmse_mm[1])} to ${number(a.rmse_mm[2])}), n = ${a.n}; clock certificate: ${a.certificate.status}`
  : `INVALID: ${a.invalid_because.join('; ')}`;
// `on.choose(press)` and `on.time(t)`: what the reader picks on the map, in the list and on the strips; `on.clusters()`: whether to draw them.
export const player = async (named, on, signal) => {
  const s = await json('session', named);
  const pictures = [1, 2].map(cameraPicture);
  const said = el('p', { class: 'soft', role: 'status' });
  const list = el('div');
  const whole = timeline('Session: event rates, presses, clock marks, touches felt', on.time), strip = timeline('Press: phases, clock marks, touches felt', on.time);
  const phases = el('p', { class: 'soft' });
  const map = skinMap(s.outline_mm, s.cameras, on.choose);
  let all = [], chosen = null, found = null, shown = null;
  const presses = rows => {
    all = rows;
    map.draw(rows);
    whole.draw(s, rows, s.span_s);
    list.replaceChildren(table('Presses', ['Press', 'Role', 'x, y (mm)', 'Depth (mm)', 'Verdict', 'Error (mm)', 'Reason'], rows.map(p => [
      el('button', { type: 'button', 'aria-label': `Go to press ${p.press}`, onclick: () => on.choose(p) }, String(p.press)), p.role,
      p.at_mm.map(v => number(v, 1)).join(', '), number(p.depth_mm), p.verdict, number(p.error_mm), p.reason])));
  };
  const choose = async press => {
    [chosen, found] = [press, null];
    map.mark(press);
    strip.svg.toggleAttribute('hidden', !press?.times_s);
    phases.textContent = '';
    if (!press?.times_s) return;
    const [approach, contact, depth, retract, release, clear] = press.times_s;
    strip.draw(s, [press], [approach, clear], press.times_s);
    const felt = s.touches.filter(row => row[0] >= approach && row[0] <= clear && ['onset', ...REACTIONS].includes(row[1]));
    phases.textContent = `Press ${press.press}: ${[['approach', approach], ['contact', contact], ['at depth', depth], ['retract', retract], ['release', release], ['clear', clear],
      ...felt.map(row => [row[1] === 'onset' ? 'felt' : `${row[1]} because it was felt`, row[0]])]
      .map(([word, t]) => `${word} ${number(t - contact)} s`).join(', ')}; ${s.marks.filter(m => m[2] === press.press).length} clock marks`;
    if (!s.analysis) return;
    try {
      const clusters = await json('clusters', { ...named, press: press.press }, { signal });
      if (chosen === press) found = clusters.cameras;
    } catch (error) { if (!signal.aborted) said.textContent = error.message; }
  };
  const show = async (t, accumulation_s) => {
    const window_ = { ...named, from_s: t - accumulation_s, to_s: t };
    try {
      const [one, two, { poses }] = await Promise.all([
        ...[1, 2].map(camera => bytes('events', { ...window_, camera }, { signal })),
        json('poses', { ...named, from_s: t - 0.05, to_s: t }, { signal })]);
      const inPress = chosen?.times_s && t >= chosen.times_s[0] && t <= chosen.times_s[5];
      const counts = [one, two].map((f, k) => pictures[k].events(f, inPress ? chosen.views?.[k] : null, inPress && on.clusters() ? found?.[k] : null));
      const tip = poses.at(-1);
      const touch = feltAt(s.touches, t);
      map.mark(chosen, tip?.slice(1, 4), touch?.at_mm && touch);
      [whole, strip].forEach(line => line.at(t));
      const mark = s.marks.findLast(m => m[0] <= t && m[0] > t - Math.max(MARK_S, accumulation_s));
      said.textContent = `${number(t, 3)} s: ${counts[0]} and ${counts[1]} events; tip ${tip ? height(tip[3]) : 'unknown'}`
        + (touch ? '; a touch is felt' + (touch.depth ? `, ${number(touch.depth.mm, 1)} ± ${number(touch.depth.within_mm, 1)} mm deep` : '') : '')
        + (mark ? `; clock mark: ${mark[1].replaceAll('_', ' ')}, press ${mark[2]}` : '')
        + (s.clocks_measured.every(Boolean) ? '' : '; camera times from arrivals, good to milliseconds');
      shown = { t_s: t, press: inPress ? chosen.press : null, events: counts, tip_mm: tip?.slice(1, 4) ?? null };
      return true;
    } catch (error) { if (!signal.aborted) said.textContent = error.message; return false; }
  };
  presses(s.presses);
  strip.svg.toggleAttribute('hidden', true);
  return {
    s, named, pictures, map, said, list, presses, choose, show,
    all: () => all, chosen: () => chosen, shown: () => shown,
    // A press to look at; at the start of a session there are few events.
    first: () => all.find(p => p.role === 'score' && p.times_s) ?? all.find(p => p.times_s),
    mapCard: el('section', { class: 'card map', 'aria-label': 'Skin map' }, map.svg,
      el('p', { class: 'soft' }, 'Colour: error, from 0 mm (blue) to 5 mm and more (red); without an error, the verdict. Lines: rays of both cameras; they meet at the dot.')),
    screens: [el('div', { class: 'cameras fig' }, pictures.map(p => p.canvas)), whole.svg, strip.svg, phases, said],
  };
};
