// SPDX-License-Identifier: Apache-2.0
// All voxels that the client holds, in chunks that go to the graphics card as they are: 8 bytes a voxel,
//   word 0: x | y << 8 | z << 16 (cell within the chunk) | intensity << 24
//   word 1: tenths of a second at which the voxel arrived or changed | flags << 24

import { FLAG_GONE, FLAG_LIVE, type Frame } from "./frame";
import { Checksum } from "./checksum";
import { LEVELS, type PerLevel, type Vector3 } from "./protocol";

/** Cells per chunk edge are a power of two per level: 16 m with the cell sizes 0.125, 0.25 and 0.5 m. */
export const CHUNK_BITS: PerLevel = [7, 6, 5];
const FIRST_CAPACITY = 64;
const TICK_MASK = 0xffffff;
const HEIGHT_BIN_M = 0.25;
const CHUNK_OFFSET = 1 << 16;
const CHUNK_RANGE = 1 << 17;

interface Chunk {
  key: number;
  level: number;
  corner: Vector3; // absolute index of the first cell
  slots: Map<number, number>; // cell within the chunk -> slot
  words: Uint32Array;
  count: number;
  dirtyFrom: number; // slots that the drawing side does not have yet
  dirtyTo: number;
}

/** What the drawing side must do to one chunk. With `from` 0 and `count` 0 the chunk is gone. */
export interface ChunkUpdate {
  key: number;
  level: number;
  cell: number;
  corner: Vector3;
  count: number;
  from: number;
  words: Uint32Array<ArrayBuffer>;
}

export class VoxelStore {
  readonly counts: PerLevel = [0, 0, 0];
  private readonly cells: PerLevel = [0, 0, 0];
  private chunks = new Map<number, Chunk>();
  private readonly changed = new Set<number>();
  private readonly sum = new Checksum();
  private readonly heightBins = new Map<number, number>();

  checksum(): string {
    return this.sum.hex();
  }

  /** Replaces everything. A voxel that was held before with the same content keeps its age. */
  applySnapshot(frame: Frame, tick: number): void {
    const before = this.chunks;
    this.chunks = new Map();
    for (const key of before.keys()) this.changed.add(key);
    this.counts.fill(0);
    this.sum.clear();
    this.heightBins.clear();
    this.apply(frame, tick, before);
  }

  /** Adds, changes and removes the voxels of the records. */
  applyDelta(frame: Frame, tick: number): void {
    this.apply(frame, tick, null);
  }

  private apply(frame: Frame, tick: number, before: Map<number, Chunk> | null): void {
    for (let level = 0; level < LEVELS; level++) {
      const { origin, records, count, cell } = frame.levels[level];
      this.cells[level] = cell;
      for (let i = 0; i < count; i++) {
        const at = 4 * i;
        const x = origin[0] + records[at], y = origin[1] + records[at + 1], z = origin[2] + records[at + 2];
        const info = records[at + 3] & 0xffff;
        if ((info >>> 8) & FLAG_GONE) this.remove(level, x, y, z);
        else this.set(level, x, y, z, info & 0xff, (info >>> 8) & FLAG_LIVE, tick, before);
      }
    }
  }

  private chunkOf(level: number, x: number, y: number, z: number, wanted: boolean): Chunk | undefined {
    const bits = CHUNK_BITS[level];
    const cx = x >> bits, cy = y >> bits, cz = z >> bits;
    const key = ((level * CHUNK_RANGE + cx + CHUNK_OFFSET) * CHUNK_RANGE + cy + CHUNK_OFFSET) * CHUNK_RANGE + cz + CHUNK_OFFSET;
    let chunk = this.chunks.get(key);
    if (!chunk && wanted) {
      chunk = {
        key, level, corner: [cx << bits, cy << bits, cz << bits], slots: new Map(),
        words: new Uint32Array(2 * FIRST_CAPACITY), count: 0, dirtyFrom: Infinity, dirtyTo: 0,
      };
      this.chunks.set(key, chunk);
    }
    return chunk;
  }

  private set(level: number, x: number, y: number, z: number, intensity: number, isLive: number, tick: number,
    before: Map<number, Chunk> | null): void {
    const chunk = this.chunkOf(level, x, y, z, true)!;
    const cell = packCell(level, x, y, z);
    let born = tick & TICK_MASK;
    const old = before?.get(chunk.key);
    const oldSlot = old?.slots.get(cell);
    if (old && oldSlot !== undefined && old.words[2 * oldSlot] >>> 24 === intensity &&
        old.words[2 * oldSlot + 1] >>> 24 === isLive) {
      born = old.words[2 * oldSlot + 1] & TICK_MASK;
    }
    let slot = chunk.slots.get(cell);
    if (slot === undefined) {
      slot = chunk.count++;
      if (2 * slot === chunk.words.length) chunk.words = doubled(chunk.words);
      chunk.slots.set(cell, slot);
      this.counts[level]++;
      this.countHeight(level, y, 1);
    } else {
      this.sum.remove(level, x, y, z, chunk.words[2 * slot] >>> 24, chunk.words[2 * slot + 1] >>> 24);
    }
    chunk.words[2 * slot] = cell | (intensity << 24);
    chunk.words[2 * slot + 1] = born | (isLive << 24);
    this.sum.add(level, x, y, z, intensity, isLive);
    this.markDirty(chunk, slot);
  }

  private remove(level: number, x: number, y: number, z: number): void {
    const chunk = this.chunkOf(level, x, y, z, false);
    const cell = packCell(level, x, y, z);
    const slot = chunk?.slots.get(cell);
    if (!chunk || slot === undefined) return; // the checksum will tell
    this.sum.remove(level, x, y, z, chunk.words[2 * slot] >>> 24, chunk.words[2 * slot + 1] >>> 24);
    const last = --chunk.count;
    chunk.slots.delete(cell);
    if (slot !== last) {
      chunk.words.copyWithin(2 * slot, 2 * last, 2 * last + 2);
      chunk.slots.set(chunk.words[2 * slot] & 0xffffff, slot);
    }
    this.counts[level]--;
    this.countHeight(level, y, -1);
    this.markDirty(chunk, slot);
    if (chunk.count === 0) this.chunks.delete(chunk.key);
  }

  private markDirty(chunk: Chunk, slot: number): void {
    chunk.dirtyFrom = Math.min(chunk.dirtyFrom, slot);
    chunk.dirtyTo = Math.max(chunk.dirtyTo, slot + 1);
    this.changed.add(chunk.key);
  }

  private countHeight(level: number, y: number, by: number): void {
    const bin = Math.floor(((y + 0.5) * this.cells[level]) / HEIGHT_BIN_M);
    this.heightBins.set(bin, (this.heightBins.get(bin) ?? 0) + by);
  }

  /** Heights between which all but the outermost 1 % of the voxels lie [m]. */
  heightRange(): [number, number] {
    const bins = [...this.heightBins].filter(([, count]) => count > 0).sort(([a], [b]) => a - b);
    const total = bins.reduce((sum, [, count]) => sum + count, 0);
    if (total === 0) return [0, 1];
    const binAt = (rank: number): number => {
      let seen = 0;
      return (bins.find(([, count]) => (seen += count) > rank) ?? bins[bins.length - 1])[0];
    };
    return [binAt(0.01 * total) * HEIGHT_BIN_M, (binAt(0.99 * total) + 1) * HEIGHT_BIN_M];
  }

  /** What has changed since the last call, for the drawing side. */
  takeUpdates(): ChunkUpdate[] {
    const updates = [...this.changed].map((key) => this.updateOf(key));
    this.changed.clear();
    return updates;
  }

  private updateOf(key: number): ChunkUpdate {
    const chunk = this.chunks.get(key);
    if (!chunk) return { key, level: 0, cell: 0, corner: [0, 0, 0], count: 0, from: 0, words: new Uint32Array() };
    const to = Math.min(chunk.dirtyTo, chunk.count);
    const from = Math.min(chunk.dirtyFrom, to);
    chunk.dirtyFrom = Infinity;
    chunk.dirtyTo = 0;
    const { level, corner, count } = chunk;
    return { key, level, cell: this.cells[level], corner, count, from, words: chunk.words.slice(2 * from, 2 * to) };
  }
}

function packCell(level: number, x: number, y: number, z: number): number {
  const mask = (1 << CHUNK_BITS[level]) - 1;
  return (x & mask) | ((y & mask) << 8) | ((z & mask) << 16);
}

function doubled(words: Uint32Array): Uint32Array {
  const larger = new Uint32Array(2 * words.length);
  larger.set(words);
  return larger;
}
