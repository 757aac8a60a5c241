// SPDX-License-Identifier: Apache-2.0
// Between the page and its worker.

import type { LoopEdge } from "./frame";
import type { ClientText, LoopClouds, ServerText } from "./protocol";
import type { Applied } from "./session";
import type { ChunkUpdate } from "./voxel_store";

export interface StreamCounts {
  snapshots: number;
  deltas: number;
  resyncs: number;
  errors: number;
  bytes: number;
}

export type ToWorker =
  | { kind: "open"; url: string }
  | { kind: "send"; message: ClientText }
  | { kind: "retry" }
  /** The page is about to draw: hand over what has changed since it last asked. */
  | { kind: "take" };

export type FromWorker =
  | { kind: "opened" }
  | { kind: "closed"; attempt: number; retryMs: number }
  | { kind: "text"; message: ServerText }
  | { kind: "clouds"; announcement: LoopClouds; from: Float32Array; to: Float32Array }
  /** New content is waiting to be taken. Sent once, until it has been taken. */
  | { kind: "waiting" }
  | {
      kind: "content";
      chunks: ChunkUpdate[];
      applied: Applied[];
      counts: StreamCounts;
      tick: number;
      heights: [number, number];
      odometryPath: Float32Array | null;
      smoothedPath: Float32Array | null;
      loopEdges: LoopEdge[] | null;
    };
