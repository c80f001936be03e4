// Elements and texts; what the server sends becomes text, never markup.
export const $ = (query, from = document) => from.querySelector(query);
const filled = (e, attributes, children) => {
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (name.startsWith('on')) e.addEventListener(name.slice(2), value);
    else if (value !== null && value !== undefined && value !== false) e.setAttribute(name, value === true ? '' : value);
  }
  e.append(...children.flat().filter(c => c !== null && c !== undefined));
  return e;
};
export const el = (tag, attributes, ...children) => filled(document.createElement(tag), attributes, children);
export const shape = (tag, attributes, ...children) => filled(document.createElementNS('http://www.w3.org/2000/svg', tag), attributes, children);
export const number = (v, digits = 2) => v === null || v === undefined ? '–' : v.toFixed(digits);
export const fileName = path => path.split(/[\\/]/).pop();
export const problem = error => el('p', { class: 'notice bad', role: 'alert' }, error.message);
export const table = (caption, heads, rows) => el('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': caption },
  el('table', { class: 'list-rows' }, el('caption', { class: 'hidden' }, caption),
    el('thead', {}, el('tr', {}, heads.map(h => el('th', { scope: 'col' }, h)))),
    el('tbody', {}, rows.map(cells => el('tr', {}, cells.map(c => el('td', {}, c ?? '–')))))));
