// Time, speed and accumulation of a playback, and its buttons. `show(t)` draws; a new time waits for the drawing of the last one.
import { el } from '/app/dom.js';
export const labelled = (label, attributes) => {
  const input = el('input', attributes);
  return [el('label', {}, label + ' ', input), input];
};
export const transport = ({ label, span, step, show, atEnd, signal }) => {
  const [timeLabel, time] = labelled(label, { type: 'range', min: span[0], max: span[1], step: 0.001, value: span[0] });
  timeLabel.className = 'time';
  const [speedLabel, speed] = labelled('Speed', { type: 'number', min: 0.01, max: 100, step: 'any', value: 1 });
  const [windowLabel, accumulation] = labelled('Accumulation (ms)', { type: 'number', min: 1, max: 5000, value: 30 });
  let playing = false, busy = null, again = false, last = 0;
  const at = () => Number(time.value);
  const drawing = async () => {
    do { again = false; await show(at()); } while (again && !signal.aborted);
    busy = null;
  };
  const draw = () => {
    if (busy) again = true;
    else busy = drawing();
    return busy;
  };
  const play = el('button', { type: 'button', id: 'play', onclick: () => set(!playing) }, 'Play');
  const set = on => {
    playing = on;
    play.textContent = on ? 'Stop' : 'Play';
    last = performance.now();
    if (on) requestAnimationFrame(tick);
  };
  const tick = now => {
    if (!playing || signal.aborted) return;
    const next = at() + Math.min(Math.max(now - last, 0), 200) / 1000 * Number(speed.value);
    last = now;
    if (next >= Number(time.max) && !atEnd?.()) set(false);
    if (next < Number(time.max) || !playing) time.value = next;
    if (!busy) draw();
    requestAnimationFrame(tick);
  };
  const [previous, next] = [['Previous press', -1], ['Next press', 1]].map(([text, by]) => el('button', { type: 'button', onclick: () => step(by) }, text));
  time.addEventListener('input', draw);
  accumulation.addEventListener('change', draw);
  document.querySelector('#theme').addEventListener('click', draw, { signal });
  return {
    row: el('div', { class: 'transport' }, previous, play, next, timeLabel, speedLabel, windowLabel),
    at, draw, stop: () => set(false),
    go: t => { time.value = t; return draw(); },
    range: ([from, to]) => { time.min = from; time.max = to; },
    isPlaying: () => playing,
    speed: () => Number(speed.value),
    accumulation_s: () => Number(accumulation.value) / 1000,
  };
};
