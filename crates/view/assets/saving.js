// Files of what is shown: tables of the window, and a clip of the playback as a series of PNG pictures.
import { download, save } from '/app/api.js';
import { el } from '/app/dom.js';
import { labelled } from '/app/transport.js';
import { FRAME, paintFrame } from '/app/frame.js';
import { zip } from '/app/zip.js';
const MOST_FRAMES = 1000;
const TABLES = [['events_camera1', 'events of camera 1'], ['events_camera2', 'events of camera 2'], ['pose', 'path of the robot'], ['presses', 'all presses']];
const choice = (label, options) => el('select', { 'aria-label': label }, options.map(([value, text]) => el('option', { value }, text)));
const png = canvas => new Promise((resolve, reject) => {
  canvas.toBlob(blob => { if (blob) blob.arrayBuffer().then(b => resolve(new Uint8Array(b)), reject); else reject(new Error('the browser makes no PNG')); }, 'image/png');
});
const numbered = n => `frame-${String(n + 1).padStart(4, '0')}.png`;
// `players()`: the sessions that are shown; `at(player, t)`: session time of a player at time `t` of the transport.
export const saving = (players, controls, at) => {
  const said = el('p', { class: 'soft', role: 'status' });
  const what = choice('What to save', TABLES), format = choice('Format', [['csv', 'CSV'], ['npz', 'npz (numpy)']]);
  const [lengthLabel, length] = labelled('Length (s)', { type: 'number', min: 0.01, max: 600, step: 'any', value: 1 });
  const [rateLabel, rate] = labelled('Pictures per s', { type: 'number', min: 1, max: 60, value: 25 });
  const attempt = async task => {
    try { said.textContent = await task(); } catch (error) { said.textContent = error.message; }
  };
  const table = async () => {
    for (const it of players()) {
      const to_s = at(it, controls.at());
      await download({ ...it.named, what: what.value, format: format.value, from_s: to_s - controls.accumulation_s(), to_s });
    }
    return 'saved';
  };
  const clip = async () => {
    controls.stop();
    const from = controls.at(), step = controls.speed() / Number(rate.value), count = Math.floor(Number(length.value) / step) + 1;
    if (!(count >= 1 && count <= MOST_FRAMES)) throw new Error(`expected at most ${MOST_FRAMES} pictures, found ${count}: shorten the clip, raise the speed or lower the rate`);
    const all = players();
    const canvas = el('canvas', { width: FRAME[0], height: FRAME[1] * all.length }), context = canvas.getContext('2d');
    const files = [], rows = ['frame,session,t_s,press,events_camera1,events_camera2'];
    for (let n = 0; n < count; n++) {
      const done = await Promise.all(all.map(it => it.show(at(it, from + n * step), controls.accumulation_s())));
      if (!done.every(Boolean)) throw new Error(all.map(it => it.said.textContent).join('; '));
      context.resetTransform();
      for (const it of all) {
        paintFrame(context, it);
        const shown = it.shown();
        rows.push([numbered(n), it.named.session, shown.t_s, shown.press ?? '', ...shown.events].join(','));
      }
      files.push([numbered(n), await png(canvas)]);
      said.textContent = `clip: ${n + 1} of ${count} pictures`;
    }
    files.push(['frames.csv', new TextEncoder().encode(rows.join('\n') + '\n')]);
    save(zip(files), `${all.map(it => it.named.session.replace('.session.sqlite', '')).join('-beside-')}.clip.zip`);
    controls.draw();
    return `saved ${count} pictures`;
  };
  return el('div', { class: 'saving', role: 'group', 'aria-label': 'Save what is shown' },
    el('div', { class: 'transport' }, what, format, el('button', { type: 'button', id: 'save-table', onclick: () => attempt(table) }, 'Save table')),
    el('div', { class: 'transport' }, lengthLabel, rateLabel, el('button', { type: 'button', id: 'save-clip', onclick: () => attempt(clip) }, 'Save clip')), said);
};
