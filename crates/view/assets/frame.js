// A frame of a clip: both cameras as shown, and the map with the rays of the chosen press.
import { number } from '/app/dom.js';
import { extent, rays } from '/app/map.js';
export const FRAME = [960, 680];
const CAMERA = [480, 360], MAP = [480, 300];
const paintMap = (context, it, colour) => {
  const { s } = it, press = it.chosen(), tip = it.shown()?.tip_mm;
  const [left, top, width, height] = extent(s.outline_mm, s.cameras);
  const scale = Math.min(MAP[0] / width, MAP[1] / height);
  context.save();
  context.beginPath();
  context.rect(0, 0, ...MAP);
  context.clip();
  context.scale(scale, scale);
  context.translate(-left, -top);
  const dot = (p, r, fill, line) => {
    context.beginPath();
    context.arc(p[0], -p[1], r, 0, 2 * Math.PI);
    if (fill) { context.fillStyle = fill; context.fill(); }
    if (line) { context.strokeStyle = line; context.stroke(); }
  };
  context.lineWidth = 0.4;
  context.beginPath();
  s.outline_mm.forEach(([x, y]) => context.lineTo(x, -y));
  context.closePath();
  context.fillStyle = colour('--skin');
  context.fill();
  context.strokeStyle = colour('--ink');
  context.stroke();
  it.all().forEach(p => dot(p.truth_mm ?? p.at_mm, 1, colour('--mark')));
  context.lineWidth = 0.6;
  rays(press, s.cameras).forEach((ray, k) => {
    if (!ray) return;
    context.strokeStyle = colour(`--cam${k + 1}`);
    context.beginPath();
    context.moveTo(ray[0], -ray[1]);
    context.lineTo(ray[2], -ray[3]);
    context.stroke();
  });
  if (press) dot(press.truth_mm ?? press.at_mm, 2.4, null, colour('--hi'));
  if (press?.estimate_mm) dot(press.estimate_mm, 0.9, colour('--hi'));
  if (tip) dot(tip, 1.2, null, colour('--ink'));
  context.restore();
};
export const paintFrame = (context, it) => {
  const style = getComputedStyle(it.pictures[0].canvas), colour = name => style.getPropertyValue(name).trim() || '#888888';
  context.fillStyle = colour('--paper');
  context.fillRect(0, 0, ...FRAME);
  it.pictures.forEach((p, k) => context.drawImage(p.canvas, k * CAMERA[0], 0, ...CAMERA));
  context.strokeStyle = colour('--axis');
  context.lineWidth = 1;
  [0, 1].forEach(k => context.strokeRect(k * CAMERA[0] + 0.5, 0.5, CAMERA[0] - 1, CAMERA[1] - 1));
  context.translate(0, CAMERA[1] + 12);
  paintMap(context, it, colour);
  context.fillStyle = colour('--ink');
  context.font = '17px system-ui, sans-serif';
  const shown = it.shown(), press = it.chosen();
  [it.s.prototype, it.s.started_at, `${number(shown?.t_s, 3)} s`, press ? `press ${press.press}: error ${number(press.error_mm)} mm` : '',
    shown ? `${shown.events[0]} and ${shown.events[1]} events` : ''].forEach((text, n) => context.fillText(text, MAP[0] + 16, 26 + 26 * n, CAMERA[0] - 32));
  context.translate(0, FRAME[1] - CAMERA[1] - 12);
};
