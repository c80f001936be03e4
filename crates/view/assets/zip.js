// A ZIP archive of files as they are: PNG pictures do not get smaller.
const CRC = Uint32Array.from({ length: 256 }, (_, n) => {
  for (let k = 0; k < 8; k++) n = n & 1 ? 0xedb88320 ^ n >>> 1 : n >>> 1;
  return n;
});
const crc32 = bytes => ~bytes.reduce((c, b) => CRC[(c ^ b) & 255] ^ c >>> 8, -1) >>> 0;
// Little-endian numbers of 2 and 4 bytes.
const packed = fields => {
  const view = new DataView(new ArrayBuffer(fields.reduce((n, [size]) => n + size, 0)));
  let at = 0;
  for (const [size, value] of fields) { if (size === 2) view.setUint16(at, value, true); else view.setUint32(at, value, true); at += size; }
  return new Uint8Array(view.buffer);
};
// 1 January 1980: the oldest date of the format.
const common = (file, crc, name) => [[2, 20], [2, 0], [2, 0], [2, 0], [2, 0x21], [4, crc], [4, file.length], [4, file.length], [2, name.length], [2, 0]];
// From pairs of an ASCII name and bytes.
export const zip = files => {
  const parts = [], list = [];
  let at = 0, listed = 0;
  for (const [text, bytes] of files) {
    const name = new TextEncoder().encode(text), fields = common(bytes, crc32(bytes), name);
    const head = packed([[4, 0x04034b50], ...fields]);
    parts.push(head, name, bytes);
    const entry = packed([[4, 0x02014b50], [2, 20], ...fields, [2, 0], [2, 0], [2, 0], [4, 0], [4, at]]);
    list.push(entry, name);
    at += head.length + name.length + bytes.length;
    listed += entry.length + name.length;
  }
  const end = packed([[4, 0x06054b50], [2, 0], [2, 0], [2, files.length], [2, files.length], [4, listed], [4, at], [2, 0]]);
  return new Blob([...parts, ...list, end], { type: 'application/zip' });
};
