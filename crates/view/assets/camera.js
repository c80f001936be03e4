// The picture of one camera: ON and OFF events on the canvas, the centroid of the chosen press.
import { el } from '/app/dom.js';
export const cameraPicture = number => {
  const canvas = el('canvas', { width: 640, height: 480, role: 'img', 'aria-label': `Camera ${number}: events` });
  const context = canvas.getContext('2d');
  const clear = () => context.clearRect(0, 0, 640, 480);
  const line = view => {
    if (!view || view.u === null) return;
    context.fillStyle = '#d55e00';
    context.fillRect(view.u, 0, 1.5, 480);
  };
  return {
    canvas,
    // Pairs of u32: time, then column, row and polarity.
    events: (buffer, view) => {
      clear();
      const words = new Uint32Array(buffer);
      for (let i = 1; i < words.length; i += 2) {
        context.fillStyle = words[i] >> 19 & 1 ? '#009e73' : '#b3558c';
        context.fillRect(words[i] & 1023, words[i] >> 10 & 511, 2, 2);
      }
      line(view);
      return words.length / 2;
    },
    counts: picture => {
      clear();
      if (!picture) return;
      const bytes = Uint8Array.from(atob(picture.counts), c => c.charCodeAt(0));
      const size = picture.width * picture.height, side = 640 / picture.width;
      for (let i = 0; i < size; i++) {
        const on = bytes[i], off = bytes[size + i];
        if (!on && !off) continue;
        context.globalAlpha = Math.min(1, 0.3 + (on + off) / 20);
        context.fillStyle = on >= off ? '#009e73' : '#b3558c';
        context.fillRect(i % picture.width * side, Math.floor(i / picture.width) * side, side, side);
      }
      context.globalAlpha = 1;
    },
  };
};
