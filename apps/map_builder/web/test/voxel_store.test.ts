// SPDX-License-Identifier: Apache-2.0
import { describe, expect, it } from "vitest";
import { Checksum } from "../src/stream/checksum";
import { decodeFrame } from "../src/stream/frame";
import type { Vector3 } from "../src/stream/protocol";
import { CHUNK_BITS, VoxelStore, type ChunkUpdate } from "../src/stream/voxel_store";
import wireFormat from "../../../../docs/wire_format.md?raw";
import { checksumOf, encode, random, type TestVoxel } from "./frames";

const name = ({ level, cell }: TestVoxel): string => `${level}:${cell}`;

/** Copies updates as the drawing side does, so that only what was handed over can be seen. */
class Mirror {
  private readonly chunks = new Map<number, ChunkUpdate>();

  take(updates: ChunkUpdate[]): void {
    for (const update of updates) {
      if (update.count === 0) {
        this.chunks.delete(update.key);
        continue;
      }
      const words = new Uint32Array(2 * update.count);
      words.set((this.chunks.get(update.key)?.words ?? new Uint32Array()).subarray(0, 2 * update.count));
      words.set(update.words, 2 * update.from);
      this.chunks.set(update.key, { ...update, words });
    }
  }

  voxels(): (TestVoxel & { born: number })[] {
    return [...this.chunks.values()].flatMap(({ level, corner, count, words }) =>
      Array.from({ length: count }, (_, i) => ({
        level,
        cell: [0, 8, 16].map((shift, axis) => corner[axis] + ((words[2 * i] >>> shift) & 255)) as Vector3,
        intensity: words[2 * i] >>> 24,
        flags: words[2 * i + 1] >>> 24,
        born: words[2 * i + 1] & 0xffffff,
      })));
  }
}

describe("Checksum", () => {
  it("equals 64-bit arithmetic for all kinds of values", () => {
    const next = random(1);
    for (let i = 0; i < 500; i++) {
      const sum = new Checksum();
      const index = (): number => Math.floor((next() - 0.5) * 2 ** (4 + 28 * next()));
      const voxel = { level: i % 3, cell: [index(), index(), index()] as Vector3, intensity: i % 256, flags: i % 2 };
      sum.add(voxel.level, ...voxel.cell, voxel.intensity, voxel.flags);
      expect(sum.hex()).toBe(checksumOf([voxel]));
    }
  });

  it("meets the test vector of docs/wire_format.md", () => {
    const rows = wireFormat
      .matchAll(/^\| (\d) \| (-?\d+) \| (-?\d+) \| (-?\d+) \| (\d+) \| (\d) \| `([0-9a-f]{16})` \|$/gm);
    const all = new Checksum();
    let count = 0;
    for (const [, level, x, y, z, intensity, live, expected] of rows) {
      const values = [level, x, y, z, intensity, live].map(Number) as [number, number, number, number, number, number];
      const one = new Checksum();
      one.add(...values);
      all.add(...values);
      expect(one.hex()).toBe(expected);
      count++;
    }
    expect(count).toBeGreaterThanOrEqual(4);
    expect(all.hex()).toBe("38b8e44257b1cb8e");
  });

  it("forgets what is removed", () => {
    const sum = new Checksum();
    sum.add(0, 1, 2, 3, 4, 1);
    const before = sum.hex();
    sum.add(2, -1, -2, -3, 255, 0);
    sum.remove(2, -1, -2, -3, 255, 0);
    expect(sum.hex()).toBe(before);
  });
});

describe("VoxelStore", () => {
  it("holds what a plain map holds after any deltas and snapshots, and hands all of it over", () => {
    const next = random(7);
    const store = new VoxelStore(), mirror = new Mirror();
    let held = new Map<string, TestVoxel>();
    for (let step = 0; step < 120; step++) {
      const isSnapshot = step === 0 || next() < 0.1;
      if (isSnapshot && next() < 0.5) held = new Map();
      const records = new Map<string, TestVoxel>();
      for (let i = 0; i < 150; i++) {
        const level = Math.floor(3 * next());
        const cell = [0, 1, 2].map(() => Math.floor(300 * (next() - 0.5))) as Vector3;
        // Often a voxel that exists: changes and removals must meet something.
        const old = [...held.values()][Math.floor(held.size * next())];
        const voxel = { ...(old && next() < 0.6 ? old : { level, cell }), intensity: Math.floor(256 * next()), flags: Math.floor(2 * next()) };
        const isGone = !isSnapshot && next() < 0.3;
        records.set(name(voxel), isGone ? { ...voxel, flags: 2 } : voxel);
        if (isGone) held.delete(name(voxel));
        else held.set(name(voxel), voxel);
      }
      const origins = [0, 1, 2].map(() => [step, -step, 2 * step] as Vector3);
      const sent = isSnapshot ? [...held.values()] : [...records.values()];
      const frame = decodeFrame(encode({ origins, voxels: sent }));
      if (isSnapshot) store.applySnapshot(frame, step);
      else store.applyDelta(frame, step);
      const expected = [...held.values()];
      expect(store.checksum()).toBe(checksumOf(expected));
      expect(store.counts).toEqual([0, 1, 2].map((level) => expected.filter((voxel) => voxel.level === level).length));
      if (next() < 0.6) {
        mirror.take(store.takeUpdates());
        const seen = mirror.voxels();
        expect(checksumOf(seen)).toBe(store.checksum());
        expect(seen.length).toBe(expected.length);
      }
    }
  });

  it("keeps the age of a voxel that a snapshot brings again, and renews that of a changed one", () => {
    const store = new VoxelStore(), mirror = new Mirror();
    const voxels: TestVoxel[] = [1, 2, 3].map((x) => ({ level: 0, cell: [x, 0, 0], intensity: 10, flags: 0 }));
    store.applySnapshot(decodeFrame(encode({ voxels })), 5);
    voxels[1] = { ...voxels[1], intensity: 11 };
    store.applySnapshot(decodeFrame(encode({ voxels })), 50);
    mirror.take(store.takeUpdates());
    const born = new Map(mirror.voxels().map((voxel) => [voxel.cell[0], voxel.born]));
    expect([born.get(1), born.get(2), born.get(3)]).toEqual([5, 50, 5]);
  });

  it("survives the removal of a voxel that it does not hold", () => {
    const store = new VoxelStore();
    store.applyDelta(decodeFrame(encode({ voxels: [{ level: 0, cell: [1, 1, 1], intensity: 0, flags: 2 }] })), 0);
    expect(store.counts).toEqual([0, 0, 0]);
    expect(store.checksum()).toBe("0000000000000000");
  });

  it("hands over changed slots alone", () => {
    const store = new VoxelStore();
    const voxels: TestVoxel[] = Array.from({ length: 100 }, (_, x) => ({ level: 0, cell: [x, 0, 0], intensity: 1, flags: 0 }));
    store.applySnapshot(decodeFrame(encode({ voxels })), 0);
    expect(store.takeUpdates()[0].words.length).toBe(200);
    store.applyDelta(decodeFrame(encode({ voxels: [{ ...voxels[40], intensity: 2 }] })), 0);
    const [update] = store.takeUpdates();
    expect([update.from, update.words.length, update.count]).toEqual([40, 2, 100]);
    expect(store.takeUpdates()).toEqual([]);
  });

  it("spans the heights of all but the outliers", () => {
    const store = new VoxelStore();
    const voxels: TestVoxel[] = Array.from({ length: 1000 }, (_, i) => ({ level: 0, cell: [i % 100, Math.floor(i / 100) * 4, 0], intensity: 0, flags: 0 }));
    voxels.push({ level: 0, cell: [0, 100, 0], intensity: 0, flags: 0 });
    store.applySnapshot(decodeFrame(encode({ voxels })), 0);
    expect(store.heightRange()).toEqual([0, 4.75]);
  });

  it("has chunks of equal size on every level", () => {
    expect(CHUNK_BITS.map((bits, level) => 2 ** bits * 0.125 * 2 ** level)).toEqual([16, 16, 16]);
  });
});
