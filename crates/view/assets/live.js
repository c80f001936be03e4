// A session that is being recorded: what its follower sends, shown as it arrives, and control where the server allows it.
import { listen, post } from '/app/api.js';
import { $, el, number, problem } from '/app/dom.js';
const ask = (about, name, said) => !about.control ? [] : [
  ...['pause', 'pause_now', 'resume', 'stop', 'abort'].map(request => el('button', { type: 'button', onclick: async () => {
    try { said.textContent = `the run is ${(await post('control', { session: name, request })).state}`; } catch (e) { said.textContent = e.message; }
  } }, request.replace('_', ' '))),
  el('form', { onsubmit: async event => {
    event.preventDefault();
    const form = new FormData(event.target);
    try { await post('note', { session: name, by: form.get('by'), text: form.get('text') }); said.textContent = 'noted'; } catch (e) { said.textContent = e.message; }
  } }, el('label', {}, 'Your name ', el('input', { type: 'text', name: 'by', required: true, maxlength: 64 })), ' ',
  el('label', {}, 'Note ', el('input', { type: 'text', name: 'text', required: true, maxlength: 2000 })), ' ', el('button', { type: 'submit' }, 'Add note')),
];
// What a run feels, in words.
const feeling = t => [`felt: ${t.felt} of ${t.presses} scored presses, ${t.between} touch${t.between === 1 ? '' : 'es'} between presses`,
  t.skipped && `skipped bytes ${t.skipped} times to keep up`,
  !t.touching ? 'not touched now' : ['touched now', t.at_mm && `at (${t.at_mm.map(v => number(v, 1)).join(', ')}) mm`,
    t.region && `95 % region ${t.region.semi_axes_mm.map(v => number(v, 1)).join(' x ')} mm (semi-axes)`,
    t.depth && `${number(t.depth.mm, 1)} ± ${number(t.depth.within_mm, 1)} mm deep`].filter(Boolean).join(', '),
].filter(Boolean).join('; ');
// A mark in the browser's own timeline: the pictures taken then are on the screen now.
const shown = all => {
  performance.clearMarks('pictures');
  performance.mark('pictures', { detail: Math.max(...all.map(p => p?.unix_s ?? 0)) });
};
export const live = (name, about, view, signal) => {
  const alarms = el('div', { role: 'alert' }), state = el('p', { role: 'status' }), said = el('p', { role: 'status' });
  const felt = el('p');
  const certificate = el('p'), notes = el('ul');
  const card = el('section', { class: 'card', 'aria-label': 'Run' }, alarms, state, felt, certificate, el('div', { class: 'transport' }, ask(about, name, said)), said, notes);
  // Only the newest pictures are drawn, and none on a page that is not in sight.
  let newest = null;
  const draw = () => {
    const all = newest;
    newest = null;
    view.pictures(all);
    if (all.some(p => p?.unix_s)) requestAnimationFrame(() => shown(all));
  };
  const on = {
    alarms: all => alarms.replaceChildren(...all.map(a => el('p', { class: `notice ${a.level}` }, a.text))),
    run: ({ run, writer, free_bytes: free }) => {
      const r = run?.cameras?.map((c, k) => `camera ${k + 1} ${number((c.events_per_s ?? 0) / 1000, 1)} kev/s`).join(', ');
      state.textContent = run ? `${run.state}: ${run.done} of ${run.planned} presses; ${r}; to go ${number(run.eta_s, 0)} s; disk ${number((free ?? 0) / 1e9, 1)} GB free`
        : writer ? `written by ${writer}` : 'not running';
      const touch = run?.touch;
      felt.textContent = touch ? feeling(touch) : '';
      if (run?.tip_mm) view.tip(run.tip_mm, touch?.touching && touch.at_mm ? touch : null);
    },
    presses: rows => view.presses(rows),
    pictures: all => { if (!newest) requestAnimationFrame(draw); newest = all; },
    analysis: a => { certificate.textContent = `clock certificate: ${a.certificate.status}; ${a.calibrated ? 'error' : 'residual against the nominal geometry'} of ${a.n} scored presses: RMSE ${number(a.rmse_mm[0])} mm`; },
    journal: j => notes.replaceChildren(...j.notes.map(([t, text]) => el('li', {}, `${number(t, 1)} s: ${text}`))),
    over: ({ error }) => { state.textContent = error ?? 'the run has ended; reload for its playback'; },
  };
  listen({ session: name }, on, signal).catch(error => { if (!signal.aborted) alarms.replaceChildren(problem(error)); });
  return card;
};
