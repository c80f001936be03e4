// One session: map, both cameras, time slider, table of presses; live while it is being recorded.
import { $, el, fileName } from '/app/dom.js';
import { player, summary } from '/app/player.js';
import { labelled, transport } from '/app/transport.js';
import { saving } from '/app/saving.js';
import { live } from '/app/live.js';
export const session = async (named, about, signal) => {
  const choose = press => {
    const ready = it.choose(press);
    if (press?.times_s) controls.go(press.times_s[2]);
    ready.then(() => controls.draw());
  };
  const [layerLabel, layer] = labelled('Clusters', { type: 'checkbox', checked: true, onchange: () => controls.draw() });
  const it = await player(named, { choose, time: t => controls.go(t), clusters: () => layer.checked }, signal);
  const { s } = it;
  const controls = transport({
    label: 'Time (s)', span: s.span_s, signal,
    step: by => { const next = it.all()[it.all().indexOf(it.chosen()) + by]; if (next) choose(next); },
    show: t => it.show(t, controls.accumulation_s()),
  });
  $('#title').textContent = s.prototype;
  $('#sub').textContent = `${s.started_at}, ${fileName(s.protocol)}, ${s.rig} (${s.origin ?? 'origin unknown'})`;
  const card = s.writer ? live(named.session, about, {
    presses: it.presses, pictures: all => { if (!controls.isPlaying()) all.forEach((p, k) => it.pictures[k].counts(p)); },
    tip: (tip, touch) => { if (!controls.isPlaying()) it.map.mark(it.chosen(), tip, touch); },
  }, signal) : '';
  const first = it.first();
  if (!s.writer) { if (first) choose(first); else controls.draw(); }
  return [card,
    el('p', { class: `notice ${s.analysis && !s.analysis.valid ? 'bad' : ''}` }, summary(s.analysis)),
    el('div', { class: 'two' }, it.mapCard,
      el('section', { class: 'card', 'aria-label': 'Playback' }, it.screens, controls.row, el('div', { class: 'transport' }, layerLabel), saving(() => [it], controls, (_, t) => t))),
    el('section', { class: 'card' }, el('h2', {}, 'Presses'), it.list),
  ];
};
