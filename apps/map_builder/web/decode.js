// SPDX-License-Identifier: Apache-2.0
// Reads one binary frame of the stream, as docs/wire_format.md lays it out.

export const PROTOCOL = "ignis.lio_map.v1";
const HEADER_BYTES = 76;
const RECORD_BYTES = 8;

/** Throws when the frame's length contradicts its counts. Voxel records stay a view into the buffer. */
export function decodeFrame(buffer) {
  if (buffer.byteLength < HEADER_BYTES) throw new Error("frame is shorter than its header");
  const data = new DataView(buffer);
  const f32 = (at) => data.getFloat32(at, true);
  const pose = {
    position: [f32(0), f32(4), f32(8)],
    quaternion: { w: f32(12), x: f32(16), y: f32(20), z: f32(24) },
  };
  const levels = [];
  for (let i = 0; i < 3; i++) {
    const at = 28 + 16 * i;
    levels.push({ cell: f32(at), count: data.getUint32(at + 4, true), min: f32(at + 8), max: f32(at + 12) });
  }
  let at = HEADER_BYTES;
  const take = (bytes) => {
    if (at + bytes > buffer.byteLength) throw new Error("frame is cut short");
    at += bytes;
    return at - bytes;
  };
  for (const level of levels) {
    const start = take(12);
    level.origin = [0, 4, 8].map((offset) => data.getInt32(start + offset, true));
    level.records = new Uint8Array(buffer, take(RECORD_BYTES * level.count), RECORD_BYTES * level.count);
  }
  const floats = (perItem) => {
    const count = data.getUint32(take(4), true);
    return new Float32Array(buffer, take(4 * perItem * count), perItem * count);
  };
  const eskfPath = floats(3);
  const smoothedPath = floats(3);
  const loopEdges = floats(6);
  if (at !== buffer.byteLength) throw new Error("frame has bytes behind its end");
  return { pose, levels, eskfPath, smoothedPath, loopEdges };
}

/** Body vector to world by the frame's quaternion. */
export function rotate(q, [x, y, z]) {
  const tx = 2 * (q.y * z - q.z * y), ty = 2 * (q.z * x - q.x * z), tz = 2 * (q.x * y - q.y * x);
  return [
    x + q.w * tx + q.y * tz - q.z * ty,
    y + q.w * ty + q.z * tx - q.x * tz,
    z + q.w * tz + q.x * ty - q.y * tx,
  ];
}
