// Reads messages of the web stream (docs/web.md).
export const KIND = { setting: 1, frame: 2 };
export const BLOCK = { surface: 1, particles: 2, lines: 3, json: 4 };
export const ROLE = { other: 0, real: 1, body: 2, obstacle: 3, blade: 4, tool: 5, camera: 6, box: 7, liquid: 8, setting: 9, status: 10 };
export const FLAG = { wide: 1, normals: 2, sameTriangles: 4 };

const text = new TextDecoder();

// buffer: an ArrayBuffer that holds one message. Vertices and triangles are views into it.
export function decode(buffer) {
  const v = new DataView(buffer);
  if (buffer.byteLength < 40 || text.decode(new Uint8Array(buffer, 0, 4)) !== 'TCTW') throw new Error('no message of a Tactus web stream');
  const version = v.getUint32(4, true);
  if (version !== 1) throw new Error(`the stream has version ${version}, this page reads 1: reload it`);
  const message = { kind: v.getUint32(8, true), frame: v.getUint32(16, true), time_s: v.getFloat64(24, true), captured_unix_s: v.getFloat64(32, true), blocks: [] };
  const blocks = v.getUint32(12, true);
  for (let i = 0, at = 40; i < blocks; ++i) {
    const size = v.getUint32(at + 8, true), nameBytes = v.getUint32(at + 12, true);
    const block = {
      kind: v.getUint32(at, true), role: v.getUint32(at + 4, true), count: v.getUint32(at + 16, true), triangles: v.getUint32(at + 20, true),
      color: [v.getUint8(at + 24) / 255, v.getUint8(at + 25) / 255, v.getUint8(at + 26) / 255], opacity: v.getUint8(at + 27) / 255, flags: v.getUint32(at + 28, true),
      origin: [v.getFloat32(at + 32, true), v.getFloat32(at + 36, true), v.getFloat32(at + 40, true)], step: v.getFloat32(at + 44, true),
      name: text.decode(new Uint8Array(buffer, at + 48, nameBytes)),
    };
    const data = at + 48 + Math.ceil(nameBytes / 4) * 4;
    if (block.kind === BLOCK.json) block.json = JSON.parse(text.decode(new Uint8Array(buffer, data, block.count)));
    else if (block.kind <= BLOCK.lines) {
      block.vertices = new Uint16Array(buffer, data, 4 * block.count);
      if (block.kind === BLOCK.surface)
        block.indices = new (block.flags & FLAG.wide ? Uint32Array : Uint16Array)(buffer, data + 8 * block.count, 3 * block.triangles);
    }
    message.blocks.push(block);
    at += size;
  }
  return message;
}
