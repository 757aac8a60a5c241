// SPDX-License-Identifier: Apache-2.0
// Reads the binary messages of docs/wire_format.md. Nothing is copied: what is returned looks into the buffer.

import { LEVELS, type Vector3 } from "./protocol";

const HEADER_BYTES = 76;
const UNCHANGED = 0xffffffff;
const EDGE_WORDS = 8;

export const FLAG_LIVE = 1;
export const FLAG_GONE = 2;

export interface LevelRecords {
  cell: number;
  origin: Vector3;
  count: number;
  /** Four values a voxel: cell index relative to the origin, then intensity | flags << 8. */
  records: Int16Array;
}

export interface LoopEdge {
  from: Vector3;
  to: Vector3;
  fromId: number;
  toId: number;
}

export interface Frame {
  position: Vector3;
  quaternion: [number, number, number, number];
  levels: LevelRecords[];
  /** xyz xyz ...; null when the path is as it was. */
  odometryPath: Float32Array | null;
  smoothedPath: Float32Array | null;
  loopEdges: LoopEdge[] | null;
}

class Reader {
  private at = 0;
  private readonly data: DataView;

  constructor(private readonly buffer: ArrayBuffer) {
    this.data = new DataView(buffer);
  }

  private take(bytes: number): number {
    if (this.at + bytes > this.buffer.byteLength) throw new RangeError("the message is cut short");
    this.at += bytes;
    return this.at - bytes;
  }

  f32 = (): number => this.data.getFloat32(this.take(4), true);
  i32 = (): number => this.data.getInt32(this.take(4), true);
  u32 = (): number => this.data.getUint32(this.take(4), true);
  vector = (): Vector3 => [this.f32(), this.f32(), this.f32()];

  floats(count: number): Float32Array {
    return new Float32Array(this.buffer, this.take(4 * count), count);
  }

  int16s(count: number): Int16Array {
    return new Int16Array(this.buffer, this.take(2 * count), count);
  }

  end(): void {
    if (this.at !== this.buffer.byteLength) throw new RangeError("the message has bytes behind its end");
  }
}

/** A snapshot or delta. Throws RangeError when the length contradicts the counts. */
export function decodeFrame(buffer: ArrayBuffer): Frame {
  if (buffer.byteLength < HEADER_BYTES) throw new RangeError("the message is shorter than its header");
  const read = new Reader(buffer);
  const position = read.vector();
  const quaternion: Frame["quaternion"] = [read.f32(), read.f32(), read.f32(), read.f32()];
  const heads = Array.from({ length: LEVELS }, () => {
    const head = { cell: read.f32(), count: read.u32() };
    read.f32(); // lowest and highest point: the store keeps the heights of all voxels itself
    read.f32();
    return head;
  });
  const levels = heads.map(({ cell, count }) => {
    const origin: Vector3 = [read.i32(), read.i32(), read.i32()];
    return { cell, count, origin, records: read.int16s(4 * count) };
  });
  const path = (): Float32Array | null => {
    const count = read.u32();
    return count === UNCHANGED ? null : read.floats(3 * count);
  };
  const odometryPath = path();
  const smoothedPath = path();
  const loopEdges = readEdges(read);
  read.end();
  return { position, quaternion, levels, odometryPath, smoothedPath, loopEdges };
}

function readEdges(read: Reader): LoopEdge[] | null {
  const count = read.u32();
  if (count === UNCHANGED) return null;
  const words = read.floats(EDGE_WORDS * count);
  const ids = new Int32Array(words.buffer, words.byteOffset, words.length);
  return Array.from({ length: count }, (_, i) => {
    const at = EDGE_WORDS * i;
    return {
      from: [words[at], words[at + 1], words[at + 2]] as Vector3,
      to: [words[at + 3], words[at + 4], words[at + 5]] as Vector3,
      fromId: ids[at + 6],
      toId: ids[at + 7],
    };
  });
}

/** The two clouds of a loop, in frame map. Throws RangeError when the length contradicts the counts. */
export function decodeLoopClouds(buffer: ArrayBuffer): { from: Float32Array; to: Float32Array } {
  const read = new Reader(buffer);
  const counts = [read.u32(), read.u32()];
  const from = read.floats(3 * counts[0]);
  const to = read.floats(3 * counts[1]);
  read.end();
  return { from, to };
}
