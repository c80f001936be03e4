// Which view the address asks for.
import { address, json, place } from '/app/api.js';
import { $, problem } from '/app/dom.js';
import { shelf } from '/app/shelf.js';
import { session } from '/app/session.js';
import { beside } from '/app/beside.js';
// A session and perhaps the name of one of its analyses.
const named = (session, analysis) => place().get(session) && { session: place().get(session), ...place().get(analysis) && { analysis: place().get(analysis) } };
let leave = new AbortController();
const show = async () => {
  leave.abort();
  leave = new AbortController();
  const { signal } = leave;
  const main = $('#main');
  const [one, two] = [named('session', 'analysis'), named('beside', 'beside_analysis')];
  $('#home').href = address({});
  try {
    const about = await json('about');
    const content = one && two ? await beside([one, two], signal) : one ? await session(one, about, signal) : await shelf(about);
    if (!signal.aborted) main.replaceChildren(...content);
  } catch (error) {
    if (!signal.aborted) main.replaceChildren(problem(error));
  }
};
$('#skip').addEventListener('click', event => { event.preventDefault(); $('#main').focus(); });
addEventListener('hashchange', show);
show();
