// The lab's shelf: sessions with search, settings in which two of them differ, prototypes, nights.
import { address, json } from '/app/api.js';
import { $, el, number, problem, table } from '/app/dom.js';
const rmse = analyses => analyses.map(a => `${a.name ?? 'official'}: ${a.rmse_mm ? number(a.rmse_mm[0]) + ' mm' : a.trouble}`).join('; ');
export const shelf = async about => {
  const found = await json('shelf');
  $('#title').textContent = 'Sessions';
  $('#sub').textContent = about.folder;
  const list = el('div');
  const differences = el('div', { role: 'status' });
  const chosen = new Set();
  const compare = el('button', { type: 'button', disabled: true, onclick: async () => {
    const [a, b] = chosen;
    try {
      const { differences: rows, keys } = await json('differences', { a, b });
      differences.replaceChildren(el('h3', {}, `${rows.length} of ${keys} settings differ`), table('Settings that differ', ['Setting', a, b], rows.map(r => [r.key, r.a, r.b])));
    } catch (error) { differences.replaceChildren(problem(error)); }
  } }, 'Differences of two');
  const pick = name => el('input', { type: 'checkbox', 'aria-label': `Choose ${name}`, onchange: event => {
    if (event.target.checked) chosen.add(name); else chosen.delete(name);
    compare.disabled = chosen.size !== 2;
  } });
  const show = words => {
    chosen.clear();
    compare.disabled = true;
    const fits = s => words.every(w => JSON.stringify(s).toLowerCase().includes(w));
    const rows = found.sessions.filter(fits).reverse();
    list.replaceChildren(table('Sessions', ['', 'Session', 'Prototype', 'Protocol', 'Rig', 'Valid', 'State', 'RMSE', 'Tags'], rows.map(s => [
      pick(s.name), el('a', { href: address({ session: s.name }) }, s.started_at ?? s.name), s.prototype, s.protocol_name, s.rig_name,
      s.presses ? `${s.presses.valid}/${s.presses.planned}` : null, s.writer ? 'recording' : s.end ?? s.reason ?? s.state, rmse(s.analyses), (s.tags ?? []).join(' '),
    ])));
  };
  show([]);
  const search = el('input', { type: 'search', oninput: event => show(event.target.value.toLowerCase().split(/\s+/).filter(Boolean)) });
  const series = Array.isArray(found.prototypes) ? found.prototypes.flatMap(p => p.series.map(s => [p.prototype, s.protocol, s.rig_kind, String(s.points.length),
    s.points.map(q => number(q.rmse_mm?.value)).join(', ')])) : [[found.prototypes.error]];
  const nights = Array.isArray(found.nights) ? found.nights.map(n => [n.started, n.suite, n.rig]) : [[found.nights.error]];
  return [
    el('section', { class: 'card' }, el('div', { class: 'transport' }, el('label', {}, 'Search ', search), compare), list, differences),
    el('section', { class: 'card' }, el('h2', {}, 'Prototypes'), table('Prototypes', ['Prototype', 'Protocol', 'Rig', 'Sessions', 'RMSE over time (mm)'], series)),
    nights.length ? el('section', { class: 'card' }, el('h2', {}, 'Nights'), table('Nights', ['Started', 'Suite', 'Bench'], nights)) : '',
  ];
};
