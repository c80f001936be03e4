// Which view the address asks for.
import { address, json, place } from '/app/api.js';
import { $, problem } from '/app/dom.js';
import { shelf } from '/app/shelf.js';
import { session } from '/app/session.js';
let leave = new AbortController();
const show = async () => {
  leave.abort();
  leave = new AbortController();
  const { signal } = leave;
  const main = $('#main');
  const name = place().get('session');
  $('#home').href = address({});
  try {
    const about = await json('about');
    const content = name ? await session(name, about, signal) : await shelf(about);
    if (!signal.aborted) main.replaceChildren(...content);
  } catch (error) {
    if (!signal.aborted) main.replaceChildren(problem(error));
  }
};
$('#skip').addEventListener('click', event => { event.preventDefault(); $('#main').focus(); });
addEventListener('hashchange', show);
show();
