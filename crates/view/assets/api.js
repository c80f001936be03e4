// Requests to this server, with the token that stands behind the # of the link, and its stream of events.
export const place = () => new URLSearchParams(location.hash.slice(1));
const bearer = () => ({ Authorization: `Bearer ${place().get('token') ?? ''}` });
export const address = parts => {
  const to = new URLSearchParams({ token: place().get('token') ?? '' });
  for (const [name, value] of Object.entries(parts)) to.set(name, value);
  return '#' + to;
};
const answer = async (path, query, more = {}) => {
  const found = await fetch(`/api/${path}?${new URLSearchParams(query)}`, { ...more, headers: { ...bearer(), ...more.headers } });
  if (!found.ok) {
    const said = await found.json().catch(() => ({}));
    throw new Error(said.error ?? `the server answers ${found.status}`);
  }
  return found;
};
export const json = async (path, query = {}, more) => (await answer(path, query, more)).json();
export const bytes = async (path, query, more) => (await answer(path, query, more)).arrayBuffer();
export const post = (path, value) =>
  json(path, {}, { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(value) });
export const save = (blob, name) => {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
};
export const download = async query => {
  const found = await answer('download', query);
  save(await found.blob(), /filename="(.*)"/.exec(found.headers.get('Content-Disposition'))?.[1] ?? 'download');
};
// Calls `on[name](value)` for each server-sent event until the server ends the stream.
export const listen = async (query, on, signal) => {
  const found = await answer('live', query, { signal });
  const reader = found.body.pipeThrough(new TextDecoderStream()).getReader();
  let rest = '';
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return;
    const blocks = (rest + value).split('\n\n');
    rest = blocks.pop();
    for (const block of blocks) {
      const event = /^event: (.*)\ndata: (.*)$/.exec(block);
      if (event) on[event[1]]?.(JSON.parse(event[2]));
    }
  }
};
