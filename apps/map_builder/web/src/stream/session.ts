// SPDX-License-Identifier: Apache-2.0
// One connection's conversation: pairs announcements with binary messages, applies frames in order, checks each against
// what the server announced, and asks for a snapshot when something does not fit. Knows no socket and no clock.

import { decodeFrame, decodeLoopClouds, type Frame } from "./frame";
import { LEVELS, type ClientText, type FrameAnnouncement, type LoopClouds, type PerLevel, type ServerText } from "./protocol";
import { VoxelStore } from "./voxel_store";

/** After so many snapshots in a row that do not fit the next one is asked for later [tenths of a second]. */
const MOST_MISFITS = 3;
const ASK_PAUSE = 50;

/** What is held after a frame, beside what the server announced for it. */
export interface Applied {
  sequence: number;
  revision: number;
  utime: number;
  checksum: string;
  counts: PerLevel;
  announcedChecksum: string;
  announcedCounts: PerLevel;
}

export interface SessionEvents {
  send(message: ClientText): void;
  text(message: ServerText): void;
  applied(applied: Applied, frame: Frame): void;
  clouds(announcement: LoopClouds, clouds: { from: Float32Array; to: Float32Array }): void;
}

export class StreamSession {
  snapshots = 0;
  deltas = 0;
  resyncs = 0;
  errors = 0;
  private sequence: number | null = null; // null: only a snapshot helps
  private misfits = 0; // snapshots in a row without the announced checksum
  private askedAt = 0; // tick of the newest demand
  private announced: FrameAnnouncement | LoopClouds | null = null;

  constructor(private readonly store: VoxelStore, private readonly events: SessionEvents) {}

  /** A new connection: the next frame must be a snapshot. */
  begin(): void {
    this.sequence = null;
    this.announced = null;
  }

  takeText(text: string): void {
    let message: ServerText | null = null;
    try {
      message = JSON.parse(text) as ServerText | null;
    } catch {
      // Counted below.
    }
    if (typeof message !== "object" || message === null) {
      this.errors++;
      return;
    }
    if (message.type === "frame") this.announceFrame(message);
    else if (message.type === "loop_clouds") this.announced = message;
    else this.events.text(message);
  }

  /** An announcement that lacks something announces nothing: the binary message behind it is then asked for again. */
  private announceFrame(message: FrameAnnouncement): void {
    const { kind, sequence, revision, utime, counts, checksum } = message;
    const isWhole =
      (kind === "snapshot" || kind === "delta") &&
      [sequence, revision, utime].every(Number.isSafeInteger) &&
      Array.isArray(counts) && counts.length === LEVELS && counts.every(Number.isSafeInteger) &&
      typeof checksum === "string";
    this.announced = isWhole ? message : null;
    if (!isWhole) this.errors++;
  }

  takeBinary(buffer: ArrayBuffer, tick: number): void {
    const announced = this.announced;
    this.announced = null;
    try {
      if (announced === null) throw new RangeError("a binary message came without announcement");
      if (announced.type === "loop_clouds") this.events.clouds(announced, decodeLoopClouds(buffer));
      else this.takeFrame(announced, buffer, tick);
    } catch (error) {
      if (!(error instanceof RangeError)) throw error;
      this.errors++;
      this.resync(tick);
    }
  }

  private takeFrame(announced: FrameAnnouncement, buffer: ArrayBuffer, tick: number): void {
    const isSnapshot = announced.kind === "snapshot";
    if (!isSnapshot && announced.base !== this.sequence) {
      // A snapshot that has been asked for is on its way, unless something between swallowed it.
      if (this.sequence !== null || tick - this.askedAt >= ASK_PAUSE) this.resync(tick);
      return;
    }
    const frame = decodeFrame(buffer);
    if (isSnapshot) {
      this.store.applySnapshot(frame, tick);
      this.snapshots++;
    } else {
      this.store.applyDelta(frame, tick);
      this.deltas++;
    }
    this.sequence = announced.sequence;
    const checksum = this.store.checksum();
    this.events.applied(
      {
        sequence: announced.sequence,
        revision: announced.revision,
        utime: announced.utime,
        checksum,
        counts: [...this.store.counts],
        announcedChecksum: announced.checksum,
        announcedCounts: announced.counts,
      },
      frame,
    );
    const fits = checksum === announced.checksum;
    if (isSnapshot) this.misfits = fits ? 0 : this.misfits + 1;
    if (fits) return;
    if (this.misfits > 0) this.errors++;
    if (this.misfits >= MOST_MISFITS && tick - this.askedAt < ASK_PAUSE) return;
    this.resync(tick);
  }

  private resync(tick: number): void {
    this.askedAt = tick;
    this.sequence = null;
    this.resyncs++;
    this.events.send({ resync: true });
  }
}
