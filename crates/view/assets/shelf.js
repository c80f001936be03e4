// The lab's shelf: sessions with search, two of them side by side or by their settings, trends of prototypes, nights.
import { address, json } from '/app/api.js';
import { $, el, fileName, number, problem, table } from '/app/dom.js';
import { trend } from '/app/trend.js';
const official = a => a.name ?? 'official';
const rmse = a => a.rmse_mm ? `${number(a.rmse_mm[0])} mm` : a.trouble;
const title = (s, analysis) => [s.prototype ?? s.name, s.started_at, analysis && official(analysis)].filter(Boolean).join(', ');
export const shelf = async about => {
  const found = await json('shelf');
  $('#title').textContent = 'Sessions';
  $('#sub').textContent = about.folder;
  const list = el('div');
  const differences = el('div', { role: 'status' });
  // Chosen analyses in the order of choice: name of the session, name of the analysis, title.
  let chosen = [];
  const compare = el('button', { type: 'button', id: 'differences', disabled: true, onclick: async () => {
    const [a, b] = chosen;
    try {
      const { differences: rows, keys } = await json('differences', { a: a.session, b: b.session, ...a.analysis && { a_analysis: a.analysis }, ...b.analysis && { b_analysis: b.analysis } });
      differences.replaceChildren(el('h3', {}, `${rows.length} of ${keys} settings differ`), table('Settings that differ', ['Setting', a.title, b.title, 'For a comparison', 'Why'],
        rows.map(r => [el('span', { title: r.key }, r.label), r.a, r.b, r.severity, r.reason])));
    } catch (error) { differences.replaceChildren(problem(error)); }
  } }, 'Differences of two');
  const open = el('button', { type: 'button', id: 'beside', disabled: true, onclick: () => {
    const [a, b] = chosen;
    location.hash = address({ session: a.session, beside: b.session, ...a.analysis && { analysis: a.analysis }, ...b.analysis && { beside_analysis: b.analysis } });
  } }, 'Side by side');
  const pick = (s, analysis) => {
    const its = { session: s.name, analysis: analysis?.name ?? null, title: title(s, analysis) };
    return el('input', { type: 'checkbox', 'aria-label': `Choose ${its.title}`, onchange: event => {
      chosen = event.target.checked ? [...chosen, its] : chosen.filter(c => c !== its);
      compare.disabled = open.disabled = chosen.length !== 2;
    } });
  };
  const analyses = s => s.analyses.length ? s.analyses.map(a => el('label', { class: 'analysis' }, pick(s, a), ` ${official(a)}: ${rmse(a)}`)) : [el('label', { class: 'analysis' }, pick(s), ' not analysed')];
  const show = words => {
    chosen = [];
    compare.disabled = open.disabled = true;
    const fits = s => words.every(w => JSON.stringify(s).toLowerCase().includes(w));
    const rows = found.sessions.filter(fits).reverse();
    list.replaceChildren(table('Sessions', ['Session', 'Prototype', 'Protocol', 'Rig', 'Valid', 'State', 'Analyses (RMSE)', 'Tags'], rows.map(s => [
      el('a', { href: address({ session: s.name }) }, s.started_at ?? s.name), s.prototype, s.protocol_name && fileName(s.protocol_name), s.rig_name,
      s.presses ? `${s.presses.valid}/${s.presses.planned}` : null, s.writer ? 'recording' : s.end ?? s.reason ?? s.state, el('div', {}, analyses(s)), (s.tags ?? []).join(' '),
    ])));
  };
  show([]);
  const search = el('input', { type: 'search', oninput: event => show(event.target.value.toLowerCase().split(/\s+/).filter(Boolean)) });
  const trends = Array.isArray(found.prototypes) ? found.prototypes.flatMap(p => p.series.map(s => trend(p.prototype, s))) : [problem({ message: found.prototypes.error })];
  const nights = Array.isArray(found.nights) ? found.nights.map(n => [n.started, n.suite, n.rig]) : [[found.nights.error]];
  return [
    el('section', { class: 'card' }, el('div', { class: 'transport' }, el('label', {}, 'Search ', search), compare, open), list, differences),
    el('section', { class: 'card' }, el('h2', {}, 'Prototypes: RMSE over time (mm)'), el('div', { class: 'trends' }, trends)),
    nights.length ? el('section', { class: 'card' }, el('h2', {}, 'Nights'), table('Nights', ['Started', 'Suite', 'Bench'], nights)) : '',
  ];
};
