// One session: map, both cameras, time slider, table of presses; live while it is being recorded.
import { bytes, download, json } from '/app/api.js';
import { $, el, number, table } from '/app/dom.js';
import { skinMap } from '/app/map.js';
import { cameraPicture } from '/app/camera.js';
import { live } from '/app/live.js';
const height = mm => `${number(Math.abs(mm))} mm ${mm < 0 ? 'into' : 'above'} the skin`;
export const session = async (name, about, signal) => {
  const s = await json('session', { session: name });
  $('#title').textContent = s.prototype;
  $('#sub').textContent = `${s.started_at}, ${s.protocol}, ${s.rig} (${s.origin ?? 'origin unknown'})`;
  const pictures = [1, 2].map(cameraPicture);
  const said = el('p', { class: 'soft', role: 'status' });
  let chosen = null, playing = false, busy = false, again = false;
  const input = (label, attributes) => { const e = el('input', attributes); return [el('label', {}, label + ' ', e), e]; };
  const [timeLabel, time] = input('Time (s)', { type: 'range', min: 0, max: s.span_s[1], step: 0.001, value: 0 });
  timeLabel.className = 'time';
  const [speedLabel, speed] = input('Speed', { type: 'number', min: 0.01, max: 100, step: 'any', value: 1 });
  const [windowLabel, accumulation] = input('Accumulation (ms)', { type: 'number', min: 1, max: 5000, value: 30 });
  const span = () => ({ session: name, from_s: Number(time.value) - Number(accumulation.value) / 1000, to_s: Number(time.value) });
  const draw = async () => {
    if (busy) { again = true; return; }
    busy = true;
    try {
      const window_ = span();
      const found = await Promise.all([1, 2].map(camera => bytes('events', { ...window_, camera }, { signal })));
      const inPress = chosen?.times_s && window_.to_s >= chosen.times_s[0] && window_.to_s <= chosen.times_s[5];
      const counts = found.map((f, k) => pictures[k].events(f, inPress ? chosen.views?.[k] : null));
      const { poses } = await json('poses', { session: name, from_s: window_.to_s - 0.05, to_s: window_.to_s }, { signal });
      map.mark(chosen, poses.at(-1)?.slice(1, 4));
      said.textContent = `${number(window_.to_s, 3)} s: ${counts[0]} and ${counts[1]} events; tip ${poses.length ? height(poses.at(-1)[3]) : 'unknown'}`
        + (s.clocks_measured.every(Boolean) ? '' : '; camera times from arrivals, good to milliseconds');
    } catch (error) { if (!signal.aborted) said.textContent = error.message; playing = false; }
    busy = false;
    if (again) { again = false; draw(); }
  };
  const choose = press => {
    chosen = press;
    map.mark(press);
    if (press?.times_s) { time.value = press.times_s[2]; draw(); }
  };
  const map = skinMap(s.outline_mm, s.cameras, choose);
  const list = el('div');
  let all = [];
  const step = by => { const next = all[all.indexOf(chosen) + by]; if (next) choose(next); };
  const presses = rows => {
    all = rows;
    map.draw(rows);
    list.replaceChildren(table('Presses', ['Press', 'Role', 'x, y (mm)', 'Depth (mm)', 'Verdict', 'Error (mm)', 'Reason'], rows.map(p => [
      el('button', { type: 'button', 'aria-label': `Go to press ${p.press}`, onclick: () => choose(p) }, String(p.press)), p.role,
      p.at_mm.map(v => number(v, 1)).join(', '), number(p.depth_mm), p.verdict, number(p.error_mm), p.reason])));
  };
  presses(s.presses);
  let last = 0;
  const tick = now => {
    if (!playing || signal.aborted) return;
    const next = Number(time.value) + Math.min(now - last, 200) / 1000 * Number(speed.value);
    last = now;
    if (next >= s.span_s[1]) { playing = false; play.textContent = 'Play'; }
    time.value = next;
    if (!busy) draw();
    requestAnimationFrame(tick);
  };
  const play = el('button', { type: 'button', id: 'play', onclick: () => {
    playing = !playing;
    play.textContent = playing ? 'Stop' : 'Play';
    last = performance.now();
    requestAnimationFrame(tick);
  } }, 'Play');
  const [previous, next] = [['Previous press', -1], ['Next press', 1]].map(([text, by]) => el('button', { type: 'button', onclick: () => step(by) }, text));
  time.addEventListener('input', draw);
  accumulation.addEventListener('change', draw);
  const save = (what, format, label) => el('button', { type: 'button', onclick: () => download({ ...span(), what, format }).catch(e => { said.textContent = e.message; }) }, label);
  const card = s.writer ? live(name, about, {
    presses, pictures: all => { if (!playing) all.forEach((p, k) => pictures[k].counts(p)); }, tip: tip => { if (!playing) map.mark(chosen, tip); },
  }, signal) : '';
  const a = s.analysis;
  const summary = !a ? 'not analysed: `skinrig analyze` measures the errors' : a.valid
    ? `${a.calibrated ? 'RMSE' : 'residual against the nominal geometry'} ${number(a.rmse_mm[0])} mm (${number(a.rmse_mm[1])} to ${number(a.rmse_mm[2])}), n = ${a.n}; clock certificate: ${a.certificate.status}`
    : `INVALID: ${a.invalid_because.join('; ')}`;
  // A press to look at; at the start of a session there are few events.
  const first = s.presses.find(p => p.role === 'score' && p.times_s);
  if (!s.writer) { if (first) choose(first); else draw(); }
  return [card,
    el('p', { class: `notice ${a && !a.valid ? 'bad' : ''}` }, summary),
    el('div', { class: 'two' }, el('section', { class: 'card', id: 'map', 'aria-label': 'Skin map' }, map.svg, el('p', { class: 'soft' }, 'Colour: error, from 0 mm (blue) to 5 mm and more (red); without an error, the verdict. Lines: rays of both cameras.')),
      el('section', { class: 'card', 'aria-label': 'Playback' }, el('div', { class: 'cameras fig' }, pictures.map(p => p.canvas)),
        el('div', { class: 'transport' }, previous, play, next, timeLabel, speedLabel, windowLabel), said,
        el('div', { class: 'transport' }, save('events_camera1', 'csv', 'Events 1 as CSV'), save('events_camera2', 'csv', 'Events 2 as CSV'), save('pose', 'csv', 'Path as CSV'), save('presses', 'npz', 'Presses as npz')))),
    el('section', { class: 'card' }, el('h2', {}, 'Presses'), list),
  ];
};
