// SPDX-License-Identifier: Apache-2.0
// The checksum of a set of voxels (docs/wire_format.md): the sum, modulo 2^64, of a hash of each voxel. A sum, so that it
// does not depend on the order and can be kept up to date. In halves of 32 bits: BigInt would take seconds a snapshot.

let hi = 0;
let lo = 0;

/** [hi, lo] times the constant [constantHi, constantLo], modulo 2^64. */
function multiply(constantHi: number, constantLo: number): void {
  const a = lo >>> 16, b = lo & 0xffff;
  const c = constantLo >>> 16, d = constantLo & 0xffff;
  const bd = b * d;
  const first = a * d + (bd >>> 16);
  const second = b * c + (first & 0xffff);
  const carry = a * c + (first >>> 16) + (second >>> 16);
  hi = (carry + Math.imul(hi, constantLo) + Math.imul(lo, constantHi)) | 0;
  lo = ((second << 16) | (bd & 0xffff)) | 0;
}

/** The finaliser of splitmix64 (Steele, Lea, Flood 2014). */
function mix(): void {
  lo ^= (lo >>> 30) | (hi << 2);
  hi ^= hi >>> 30;
  multiply(0xbf58476d, 0x1ce4e5b9);
  lo ^= (lo >>> 27) | (hi << 5);
  hi ^= hi >>> 27;
  multiply(0x94d049bb, 0x133111eb);
  lo ^= (lo >>> 31) | (hi << 1);
  hi ^= hi >>> 31;
}

/** Adds [addHi, addLo], modulo 2^64. */
function add(addHi: number, addLo: number): void {
  const sum = (lo >>> 0) + (addLo >>> 0);
  hi = (hi + addHi + (sum > 0xffffffff ? 1 : 0)) | 0;
  lo = sum | 0;
}

export class Checksum {
  private high = 0;
  private low = 0;

  clear(): void {
    this.high = 0;
    this.low = 0;
  }

  /** Cell indices are absolute; `isLive` is bit 0 of the flags. */
  add(level: number, x: number, y: number, z: number, intensity: number, isLive: number): void {
    hashVoxel(level, x, y, z, intensity, isLive);
    add(this.high, this.low);
    this.high = hi;
    this.low = lo;
  }

  remove(level: number, x: number, y: number, z: number, intensity: number, isLive: number): void {
    hashVoxel(level, x, y, z, intensity, isLive);
    const difference = (this.low >>> 0) - (lo >>> 0);
    this.low = difference | 0;
    this.high = (this.high - hi - (difference < 0 ? 1 : 0)) | 0;
  }

  /** 16 hexadecimal digits, as the server writes it. */
  hex(): string {
    return [this.high, this.low].map((half) => (half >>> 0).toString(16).padStart(8, "0")).join("");
  }
}

function hashVoxel(level: number, x: number, y: number, z: number, intensity: number, isLive: number): void {
  hi = x | 0;
  lo = y | 0;
  add(0x9e3779b9, 0x7f4a7c15);
  mix();
  add(z | 0, (level << 16) | (intensity << 8) | isLive);
  mix();
}
