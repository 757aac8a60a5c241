// SPDX-License-Identifier: Apache-2.0
import { beforeEach, describe, expect, it } from "vitest";
import { pauseBefore } from "../src/stream/connection";
import type { ClientText, ServerText } from "../src/stream/protocol";
import { StreamSession, type Applied } from "../src/stream/session";
import { VoxelStore } from "../src/stream/voxel_store";
import { checksumOf, encode, type TestVoxel } from "./frames";

const voxel = (x: number): TestVoxel => ({ level: 0, cell: [x, 0, 0], intensity: 9, flags: 0 });
let sent: ClientText[], texts: ServerText[], applied: Applied[], session: StreamSession;
let tick = 0;

beforeEach(() => {
  [sent, texts, applied] = [[], [], []];
  tick = 0;
  session = new StreamSession(new VoxelStore(), {
    send: (message) => sent.push(message),
    text: (message) => texts.push(message),
    applied: (result) => applied.push(result),
    clouds: () => {},
  });
  session.begin();
});

function offer(kind: "snapshot" | "delta", sequence: number, held: TestVoxel[], records = held, checksum = checksumOf(held)): void {
  const base = kind === "delta" ? { base: sequence - 1 } : {};
  session.takeText(JSON.stringify({ type: "frame", kind, sequence, ...base, revision: sequence, counts: [held.length, 0, 0], checksum, utime: 0 }));
  session.takeBinary(encode({ voxels: records }), tick);
}

describe("StreamSession", () => {
  it("applies a snapshot and the deltas that follow it", () => {
    offer("snapshot", 1, [voxel(1)]);
    offer("delta", 2, [voxel(1), voxel(2)], [voxel(2)]);
    expect(applied.map(({ sequence, counts, checksum, announcedChecksum }) => [sequence, counts[0], checksum === announcedChecksum]))
      .toEqual([[1, 1, true], [2, 2, true]]);
    expect(sent).toEqual([]);
  });

  it("asks for a snapshot when a delta is missing, ignores deltas until it comes, and goes on from there", () => {
    offer("snapshot", 1, [voxel(1)]);
    offer("delta", 3, [voxel(1), voxel(3)], [voxel(3)]);
    offer("delta", 4, [voxel(1), voxel(4)], [voxel(4)]);
    expect(sent).toEqual([{ resync: true }]);
    expect(applied.length).toBe(1);
    offer("snapshot", 5, [voxel(5)]);
    offer("delta", 6, [voxel(5), voxel(6)], [voxel(6)]);
    expect(applied.map(({ sequence }) => sequence)).toEqual([1, 5, 6]);
    expect([session.snapshots, session.deltas, session.resyncs]).toEqual([2, 1, 1]);
  });

  it("asks for a snapshot when the checksum is another one", () => {
    offer("snapshot", 1, [voxel(1)]);
    offer("delta", 2, [voxel(1), voxel(2)], [voxel(3)]);
    expect(sent).toEqual([{ resync: true }]);
  });

  it("counts snapshots that do not fit, and soon asks for others less often", () => {
    for (let sequence = 1; sequence <= 10; sequence++) offer("snapshot", sequence, [voxel(1)], [voxel(2)]);
    expect([sent.length, session.errors]).toEqual([2, 10]);
    tick = 60;
    offer("snapshot", 11, [voxel(1)], [voxel(2)]);
    offer("snapshot", 12, [voxel(1)], [voxel(2)]);
    expect(sent.length).toBe(3);
    offer("snapshot", 13, [voxel(1)]);
    offer("delta", 14, [voxel(1), voxel(3)], [voxel(4)]);
    expect([sent.length, session.errors]).toEqual([4, 12]);
  });

  it("asks again when the snapshot that it asked for never comes", () => {
    offer("snapshot", 1, [voxel(1)]);
    for (let sequence = 5; sequence < 20; sequence++) offer("delta", sequence, [voxel(2)]);
    expect(sent.length).toBe(1);
    tick = 50;
    offer("delta", 20, [voxel(2)]);
    expect(sent.length).toBe(2);
  });

  it.each([["utime", undefined], ["sequence", "2"], ["revision", null], ["counts", [1, 0]], ["counts", "1,0"], ["checksum", 7], ["kind", "delts"]])(
    "takes no frame whose announcement has a bad %s (%s), counts it and asks for a snapshot",
    (field, value) => {
      offer("snapshot", 1, [voxel(1)]);
      const whole = { type: "frame", kind: "delta", sequence: 2, base: 1, revision: 2, counts: [2, 0, 0], checksum: "0", utime: 0 };
      session.takeText(JSON.stringify({ ...whole, [field as string]: value }));
      session.takeBinary(encode({ voxels: [voxel(2)] }), tick);
      expect([applied.length, session.errors > 0, sent]).toEqual([1, true, [{ resync: true }]]);
    },
  );

  it("begins anew after a reconnection", () => {
    offer("snapshot", 1, [voxel(1)]);
    session.begin();
    offer("delta", 2, [voxel(1), voxel(2)], [voxel(2)]);
    expect(applied.length).toBe(1);
    offer("snapshot", 1, [voxel(2)]);
    expect(applied.at(-1)!.counts).toEqual([1, 0, 0]);
  });

  it("survives broken messages and asks for a snapshot", () => {
    session.takeText("{");
    session.takeBinary(new ArrayBuffer(10), 0);
    session.takeText(JSON.stringify({ type: "frame", kind: "snapshot", sequence: 1, revision: 0, counts: [0, 0, 0], checksum: "", utime: 0 }));
    session.takeBinary(new ArrayBuffer(80), 0);
    expect(session.errors).toBe(3);
    expect(sent).toEqual([{ resync: true }, { resync: true }]);
  });

  it("hands on texts of every other kind", () => {
    session.takeText('{"type": "view", "radius": 25}');
    session.takeText('{"type": "later_invention"}');
    expect(texts.map(({ type }) => type as string)).toEqual(["view", "later_invention"]);
  });
});

describe("pauseBefore", () => {
  it("doubles up to a limit", () => {
    expect([1, 2, 3, 4, 5, 6, 60].map(pauseBefore)).toEqual([500, 1000, 1500, 1500, 1500, 1500, 1500]);
  });
});
