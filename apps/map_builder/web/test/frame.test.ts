// SPDX-License-Identifier: Apache-2.0
import { describe, expect, it } from "vitest";
import { decodeFrame, decodeLoopClouds } from "../src/stream/frame";
import { encode } from "./frames";

describe("decodeFrame", () => {
  it("reads every part of a frame", () => {
    const frame = decodeFrame(encode({
      origins: [[-8, 3, 5000], [0, 0, 0], [1, 2, 3]],
      voxels: [
        { level: 0, cell: [-9, 4, 5001], intensity: 200, flags: 1 },
        { level: 2, cell: [1, 2, 3], intensity: 7, flags: 2 },
      ],
      eskf: [[1, 2, 3], [4, 5, 6]],
      smoothed: [[7, 8, 9]],
      edges: [{ from: [1, 2, 3], to: [4, 5, 6], ids: [12, 3] }],
    }));
    expect(frame.position).toEqual([1, 2, 3]);
    expect(frame.levels.map(({ cell, count }) => [cell, count])).toEqual([[0.125, 1], [0.25, 0], [0.5, 1]]);
    expect(frame.levels[0].origin).toEqual([-8, 3, 5000]);
    expect([...frame.levels[0].records]).toEqual([-1, 1, 1, 200 | (1 << 8)]);
    expect([...frame.odometryPath!]).toEqual([1, 2, 3, 4, 5, 6]);
    expect([...frame.smoothedPath!]).toEqual([7, 8, 9]);
    expect(frame.loopEdges).toEqual([{ from: [1, 2, 3], to: [4, 5, 6], fromId: 12, toId: 3 }]);
  });

  it("tells an unchanged part from an empty one", () => {
    const unchanged = decodeFrame(encode({ voxels: [], eskf: null, smoothed: null, edges: null }));
    expect([unchanged.odometryPath, unchanged.smoothedPath, unchanged.loopEdges]).toEqual([null, null, null]);
    const empty = decodeFrame(encode({ voxels: [] }));
    expect([empty.odometryPath!.length, empty.smoothedPath!.length, empty.loopEdges!.length]).toEqual([0, 0, 0]);
  });

  it("refuses a message of any other length", () => {
    const whole = encode({ voxels: [{ level: 1, cell: [0, 0, 0], intensity: 0, flags: 0 }] });
    for (let length = 0; length < whole.byteLength; length += 4) {
      expect(() => decodeFrame(whole.slice(0, length))).toThrow(RangeError);
    }
    const longer = new Uint8Array(whole.byteLength + 4);
    longer.set(new Uint8Array(whole));
    expect(() => decodeFrame(longer.buffer)).toThrow(/behind its end/);
  });

  it("refuses counts that no message could hold", () => {
    const buffer = encode({ voxels: [] });
    new DataView(buffer).setUint32(32, 0x7fffffff, true);
    expect(() => decodeFrame(buffer)).toThrow(RangeError);
  });
});

describe("decodeLoopClouds", () => {
  it("splits the points into the two clouds", () => {
    const words = new DataView(new ArrayBuffer(8 + 36));
    words.setUint32(0, 1, true);
    words.setUint32(4, 2, true);
    for (let i = 0; i < 9; i++) words.setFloat32(8 + 4 * i, i, true);
    const { from, to } = decodeLoopClouds(words.buffer);
    expect([[...from], [...to]]).toEqual([[0, 1, 2], [3, 4, 5, 6, 7, 8]]);
    expect(() => decodeLoopClouds(words.buffer.slice(0, 40))).toThrow(RangeError);
  });
});
