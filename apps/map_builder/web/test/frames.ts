// SPDX-License-Identifier: Apache-2.0
// Writes binary messages of docs/wire_format.md: a second implementation beside the server's, for tests.

import type { Vector3 } from "../src/stream/protocol";

export interface TestVoxel {
  level: number;
  cell: Vector3;
  intensity: number;
  flags: number;
}

export interface TestFrame {
  origins?: Vector3[];
  voxels: TestVoxel[];
  eskf?: Vector3[] | null;
  smoothed?: Vector3[] | null;
  edges?: { from: Vector3; to: Vector3; ids: [number, number] }[] | null;
}

export function encode({ origins = [[0, 0, 0], [0, 0, 0], [0, 0, 0]], voxels, eskf = [], smoothed = [], edges = [] }: TestFrame): ArrayBuffer {
  const data = new DataView(new ArrayBuffer(4096 + 8 * voxels.length));
  let at = 0;
  const put = { f32: (v: number) => (data.setFloat32(at, v, true), (at += 4)), i32: (v: number) => (data.setInt32(at, v, true), (at += 4)) };
  [1, 2, 3, 1, 0, 0, 0].forEach(put.f32);
  for (const level of [0, 1, 2]) {
    put.f32(0.125 * 2 ** level);
    put.i32(voxels.filter((voxel) => voxel.level === level).length);
    put.f32(0);
    put.f32(0);
  }
  for (const level of [0, 1, 2]) {
    origins[level].forEach(put.i32);
    for (const { cell, intensity, flags } of voxels.filter((voxel) => voxel.level === level)) {
      cell.forEach((index, axis) => data.setInt16(at + 2 * axis, index - origins[level][axis], true));
      data.setUint8(at + 6, intensity);
      data.setUint8(at + 7, flags);
      at += 8;
    }
  }
  for (const path of [eskf, smoothed]) {
    put.i32(path === null ? -1 : path.length);
    path?.flat().forEach(put.f32);
  }
  put.i32(edges === null ? -1 : edges.length);
  for (const { from, to, ids } of edges ?? []) {
    [...from, ...to].forEach(put.f32);
    ids.forEach(put.i32);
  }
  return data.buffer.slice(0, at) as ArrayBuffer;
}

const MASK = (1n << 64n) - 1n;

function mixed(z: bigint): bigint {
  z = ((z ^ (z >> 30n)) * 0xbf58476d1ce4e5b9n) & MASK;
  z = ((z ^ (z >> 27n)) * 0x94d049bb133111ebn) & MASK;
  return z ^ (z >> 31n);
}

/** The checksum as docs/wire_format.md writes it down, in plain 64-bit arithmetic. */
export function checksumOf(voxels: TestVoxel[]): string {
  const bits = (index: number): bigint => BigInt.asUintN(32, BigInt(index));
  let sum = 0n;
  for (const { level, cell: [x, y, z], intensity, flags } of voxels) {
    const first = ((bits(x) << 32n) | bits(y)) + 0x9e3779b97f4a7c15n;
    const second = (bits(z) << 32n) | (BigInt(level) << 16n) | (BigInt(intensity) << 8n) | BigInt(flags & 1);
    sum += mixed((mixed(first & MASK) + second) & MASK);
  }
  return (sum & MASK).toString(16).padStart(16, "0");
}

/** Numbers that are the same in each run. */
export function random(seed: number): () => number {
  let state = seed >>> 0;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}
