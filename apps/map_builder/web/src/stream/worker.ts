// SPDX-License-Identifier: Apache-2.0
// The worker: socket and voxels. What the page has not fetched yet accumulates as "chunk so-and-so has changed", never
// as a queue of frames, so a hidden tab costs no memory.

import { Connection } from "./connection";
import type { LoopEdge } from "./frame";
import { StreamSession, type Applied } from "./session";
import { VoxelStore } from "./voxel_store";
import type { FromWorker, ToWorker } from "./worker_messages";

/** Checksums that the page keeps for comparison; older ones go. */
const KEPT_APPLIED = 300;

let connection: Connection | null = null;
let bytes = 0;
let isAnnounced = false;
let applied: Applied[] = [];
let odometryPath: Float32Array | null = null;
let smoothedPath: Float32Array | null = null;
let loopEdges: LoopEdge[] | null = null;

const post = (message: FromWorker, transfer: Transferable[] = []): void => self.postMessage(message, { transfer });
/** Tenths of a second since the worker began; wraps after 19 days, as the shader does. */
const tick = (): number => Math.floor(performance.now() / 100);

const store = new VoxelStore();
const session = new StreamSession(store, {
  send: (message) => connection?.send(message),
  text: (message) => post({ kind: "text", message }),
  clouds: (announcement, { from, to }) => post({ kind: "clouds", announcement, from: from.slice(), to: to.slice() }),
  applied: (result, frame) => {
    applied.push(result);
    if (applied.length > KEPT_APPLIED) applied.shift();
    odometryPath = frame.odometryPath ?? odometryPath;
    smoothedPath = frame.smoothedPath ?? smoothedPath;
    loopEdges = frame.loopEdges ?? loopEdges;
    if (!isAnnounced) post({ kind: "waiting" });
    isAnnounced = true;
  },
});

function handOver(): void {
  const { snapshots, deltas, resyncs, errors } = session;
  const chunks = store.takeUpdates();
  post(
    {
      kind: "content", chunks, applied, counts: { snapshots, deltas, resyncs, errors, bytes }, tick: tick(),
      heights: store.heightRange(), loopEdges,
      // Copies: a view would take the whole message along.
      odometryPath: odometryPath?.slice() ?? null, smoothedPath: smoothedPath?.slice() ?? null,
    },
    chunks.map(({ words }) => words.buffer),
  );
  applied = [];
  isAnnounced = false;
  odometryPath = smoothedPath = loopEdges = null;
}

self.onmessage = ({ data }: MessageEvent<ToWorker>) => {
  if (data.kind === "take") handOver();
  else if (data.kind === "send") connection?.send(data.message);
  else if (data.kind === "retry") connection?.retryNow();
  else {
    connection = new Connection(data.url, {
      opened: () => {
        session.begin();
        post({ kind: "opened" });
      },
      closed: (attempt, retryMs) => post({ kind: "closed", attempt, retryMs }),
      text: (text) => session.takeText(text),
      binary: (buffer) => {
        bytes += buffer.byteLength;
        session.takeBinary(buffer, tick());
      },
    });
  }
};
