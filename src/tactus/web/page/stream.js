// Reads messages of the web stream (docs/web.md).
export const KIND = { setting: 1, frame: 2, summary: 3 };
export const BLOCK = { surface: 1, particles: 2, lines: 3, json: 4 };
export const ROLE = { other: 0, real: 1, body: 2, obstacle: 3, blade: 4, tool: 5, camera: 6, box: 7, liquid: 8, setting: 9, status: 10 };
export const FLAG = { wide: 1, normals: 2, sameTriangles: 4, packed: 8, difference: 16, film: 32, wetAlone: 64 };

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
      if (block.flags & FLAG.packed) block.packed = new Uint8Array(buffer, data, 8 * block.count + 12 * block.triangles);
      else block.vertices = new Uint16Array(buffer, data, 4 * block.count);
      if (block.kind === BLOCK.surface && !block.packed)
        block.indices = new (block.flags & FLAG.wide ? Uint32Array : Uint16Array)(buffer, data + 8 * block.count, 3 * block.triangles);
    }
    const films = data + 8 * block.count + block.triangles * (block.flags & FLAG.packed ? 12 : block.flags & FLAG.wide ? 12 : 6);
    if (block.flags & FLAG.film) block.film = new Uint8Array(buffer, films, block.count);
    message.blocks.push(block);
    at += size;
  }
  return message;
}

// Vertices of a report: bytes by their place in a vertex, of twice the difference (that of a negative one is inverted) from the frame before, or
// else from the vertex before.
export function unpackVertices(packed, count, before) {
  const vertices = new Uint16Array(4 * count);
  for (let w = 0; w < 4; ++w) {
    const low = 2 * w * count, high = low + count;
    for (let i = 0, at = w; i < count; ++i, at += 4) {
      const folded = packed[low + i] | packed[high + i] << 8;
      const then = before ? (at < before.length ? before[at] : 0) : (i > 0 ? vertices[at - 4] : 0);
      vertices[at] = then + ((folded >> 1) ^ -(folded & 1));
    }
  }
  return vertices;
}

// Likewise, corners of triangles: differences from the corner before, in four bytes.
export function unpackCorners(packed, count) {
  const corners = new Uint32Array(count);
  for (let i = 0, last = 0; i < count; ++i) {
    const folded = packed[i] | packed[count + i] << 8 | packed[2 * count + i] << 16 | packed[3 * count + i] << 24;
    last = corners[i] = last + ((folded >>> 1) ^ -(folded & 1));
  }
  return corners;
}

// Those on which a film lies, of all on which one ever does.
function wetTriangles(corners, film) {
  const wet = [];
  for (let i = 0; i < corners.length; i += 3)
    if (film[corners[i]] || film[corners[i + 1]] || film[corners[i + 2]]) wet.push(corners[i], corners[i + 1], corners[i + 2]);
  return new Uint32Array(wet);
}

// The messages of a report: each behind its length. Differences and triangles that were left out are filled in.
export function decodeReport(buffer) {
  const messages = [], v = new DataView(buffer);
  let before = new Map();
  for (let at = 0; at < buffer.byteLength;) {
    const size = v.getUint32(at, true), message = decode(buffer.slice(at + 4, at + 4 + size)), now = new Map();
    at += 4 + size;
    messages.push(message);
    if (message.kind !== KIND.frame) continue;
    for (const block of message.blocks) {
      if (!block.packed) continue;
      let key = `${block.role}/${block.name}`;
      while (now.has(key)) key += '+';
      now.set(key, block);
      const last = before.get(key);
      block.vertices = unpackVertices(block.packed, block.count, block.flags & FLAG.difference ? last.vertices : null);
      if (block.film && block.flags & FLAG.difference && last.film?.length === block.film.length) block.film = block.film.map((byte, v) => byte + last.film[v]);
      if (block.flags & FLAG.sameTriangles) block.indices = last.corners ?? last.indices;
      else if (block.kind === BLOCK.surface) block.indices = unpackCorners(block.packed.subarray(8 * block.count), 3 * block.triangles);
      if (block.flags & FLAG.wetAlone) {
        block.corners = block.indices;
        block.indices = wetTriangles(block.corners, block.film);
      }
      block.packed = null;
      block.flags &= ~(FLAG.sameTriangles | FLAG.packed | FLAG.difference);
    }
    before = now;
  }
  return messages;
}
