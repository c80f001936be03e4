// The picture of one camera: ON and OFF events, and what the analysis found in them for the chosen press.
import { el } from '/app/dom.js';
const WIDTH = 640, HEIGHT = 480;
export const cameraPicture = number => {
  const canvas = el('canvas', { width: WIDTH, height: HEIGHT, role: 'img', 'aria-label': `Camera ${number}: no events yet` });
  const context = canvas.getContext('2d'), layer = el('canvas', { width: WIDTH, height: HEIGHT }).getContext('2d');
  // Colours of the style sheet, light or dark.
  const colour = name => getComputedStyle(canvas).getPropertyValue(name).trim() || '#888888';
  const packed = name => {
    context.fillStyle = colour(name);
    const hex = parseInt(context.fillStyle.slice(1), 16);
    return (0xff000000 | (hex & 255) << 16 | hex & 0xff00 | hex >> 16) >>> 0;
  };
  const describe = text => canvas.setAttribute('aria-label', `Camera ${number}: ${text}`);
  const clear = () => context.clearRect(0, 0, WIDTH, HEIGHT);
  // Pixels of each cluster, below the events.
  const underlay = found => {
    if (!found) return;
    context.globalAlpha = 0.45;
    for (const [u, v, , cluster] of found.pixels) {
      if (cluster < 0) continue;
      context.fillStyle = colour(cluster === found.largest ? '--hi' : '--mark');
      context.fillRect(u - 1, v - 1, 3, 3);
    }
    context.globalAlpha = 1;
  };
  // Box of the largest cluster, the rows that the analysis looks at, and the centroid.
  const overlay = (found, view) => {
    if (found) {
      context.lineWidth = 1.5;
      context.setLineDash([6, 4]);
      context.strokeStyle = colour('--mark');
      for (const row of found.rows) { context.beginPath(); context.moveTo(0, row); context.lineTo(WIDTH, row); context.stroke(); }
      context.setLineDash([]);
      const own = found.pixels.filter(p => p[3] === found.largest), us = own.map(p => p[0]), vs = own.map(p => p[1]);
      if (own.length) {
        const [left, top] = [Math.min(...us) - 3, Math.min(...vs) - 3];
        context.font = '24px system-ui, sans-serif';
        context.strokeStyle = context.fillStyle = colour('--hi');
        context.strokeRect(left, top, Math.max(...us) + 4 - left, Math.max(...vs) + 4 - top);
        context.fillText(`${found.clusters[found.largest].events} events`, Math.max(4, Math.min(left, WIDTH - 160)), top > 40 ? top - 10 : Math.max(...vs) + 30);
      }
    }
    if (view && view.u !== null) {
      context.fillStyle = colour('--hi');
      context.fillRect(view.u - 0.5, 0, 1.5, HEIGHT);
    }
  };
  return {
    canvas,
    // Pairs of u32: time, then column, row and polarity. Returns the number of events.
    events: (buffer, view, found) => {
      clear();
      const words = new Uint32Array(buffer);
      const on = packed('--on'), off = packed('--off');
      const image = layer.createImageData(WIDTH, HEIGHT), pixels = new Uint32Array(image.data.buffer);
      for (let i = 1; i < words.length; i += 2) {
        const x = words[i] & 1023, y = words[i] >> 10 & 511;
        if (x >= WIDTH || y >= HEIGHT) continue;
        const at = y * WIDTH + x, paint = words[i] >> 19 & 1 ? on : off;
        pixels[at] = paint;
        if (x + 1 < WIDTH) pixels[at + 1] = paint;
        if (y + 1 < HEIGHT) pixels[at + WIDTH] = paint;
      }
      layer.putImageData(image, 0, 0);
      underlay(found);
      context.drawImage(layer.canvas, 0, 0);
      overlay(found, view);
      const count = words.length / 2;
      const clusters = found ? `; ${found.clusters.length} clusters in the press` + (found.largest === null ? '' : `, the largest of ${found.clusters[found.largest].events} events`) : '';
      describe(`${count} events${clusters}`);
      return count;
    },
    counts: picture => {
      clear();
      if (!picture) return;
      const bytes = Uint8Array.from(atob(picture.bins), c => c.charCodeAt(0)), side = WIDTH / picture.width;
      const on = colour('--on'), off = colour('--off');
      for (let n = 0; n < bytes.length; n += 4) {
        const at = bytes[n] | bytes[n + 1] << 8, [a, b] = [bytes[n + 2], bytes[n + 3]];
        context.globalAlpha = Math.min(1, 0.3 + (a + b) / 20);
        context.fillStyle = a >= b ? on : off;
        context.fillRect(at % picture.width * side, Math.floor(at / picture.width) * side, side, side);
      }
      context.globalAlpha = 1;
      describe(`${picture.events} events in the last ${picture.accumulation_s} s`);
    },
  };
};
