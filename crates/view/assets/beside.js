// Two sessions side by side: time since contact is the same in both, and the press number unless each is chosen by itself.
import { address } from '/app/api.js';
import { $, el } from '/app/dom.js';
import { player, summary } from '/app/player.js';
import { labelled, transport } from '/app/transport.js';
import { saving } from '/app/saving.js';
export const beside = async (names, signal) => {
  const [sameLabel, same] = labelled('Same press number', { type: 'checkbox', checked: true });
  const [layerLabel, layer] = labelled('Clusters', { type: 'checkbox', checked: true, onchange: () => controls.draw() });
  const contact = it => it.chosen()?.times_s?.[1];
  const at = (it, t) => contact(it) + t;
  const pair = () => both.filter(it => contact(it) !== undefined);
  // From the earlier approach to the later end, s after contact.
  const fit = () => {
    const spans = pair().map(it => it.chosen().times_s.map(t => t - contact(it)));
    if (spans.length) controls.range([Math.min(...spans.map(s => s[0])), Math.max(...spans.map(s => s[5]))]);
  };
  const choose = async (it, press, t) => {
    const of = number_ => other => other.all().find(p => p.press === number_ && p.times_s);
    const picks = same.checked ? both.map(other => [other, of(press.press)(other)]) : [[it, press]];
    const ready = picks.map(([other, found]) => other.choose(found ?? null));
    fit();
    const first = pair()[0];
    controls.go(t ?? (first ? first.chosen().times_s[2] - contact(first) : 0));
    await Promise.all(ready);
    controls.draw();
  };
  const step = (by, t) => {
    if (!same.checked) {
      for (const it of both) { const next = it.all()[it.all().indexOf(it.chosen()) + by]; if (next?.times_s) choose(it, next, t); }
      return true;
    }
    const numbers = both.map(it => it.all().filter(p => p.times_s).map(p => p.press));
    const shared = numbers[0].filter(n => numbers[1].includes(n));
    const next = shared[shared.indexOf(both[0].chosen()?.press) + by];
    if (next !== undefined) choose(both[0], both[0].all().find(p => p.press === next), t);
    return next !== undefined;
  };
  const both = await Promise.all(names.map(named => player(named, {
    choose: press => choose(both.find(it => it.named === named), press),
    time: t => { const it = both.find(b => b.named === named); if (contact(it) !== undefined) controls.go(t - contact(it)); },
    clusters: () => layer.checked,
  }, signal)));
  const controls = transport({
    label: 'Time since contact (s)', span: [-1, 1], signal, step,
    // In lock step: both are drawn before the next time begins.
    show: t => Promise.all(pair().map(it => it.show(at(it, t), controls.accumulation_s()))),
    atEnd: () => {
      const spans = pair().map(it => it.chosen().times_s[0] - contact(it));
      return spans.length > 0 && same.checked && step(1, Math.min(...spans));
    },
  });
  $('#title').textContent = 'Side by side';
  $('#sub').textContent = both.map(it => it.s.prototype).join(' | ');
  const first = both[0].first();
  if (first) choose(both[0], first);
  return [
    el('section', { class: 'card', 'aria-label': 'Playback of both' }, controls.row,
      el('div', { class: 'transport' }, sameLabel, layerLabel), saving(pair, controls, at)),
    el('div', { class: 'two' }, both.map((it, k) => el('section', { class: 'stack', 'aria-label': `Session ${'AB'[k]}` },
      el('p', { class: `notice ${it.s.analysis && !it.s.analysis.valid ? 'bad' : ''}` }, el('a', { href: address(it.named) }, `${'AB'[k]}: ${it.s.prototype}, ${it.s.started_at}`), ` ${summary(it.s.analysis)}`),
      el('div', { class: 'card' }, it.screens), it.mapCard))),
  ];
};
