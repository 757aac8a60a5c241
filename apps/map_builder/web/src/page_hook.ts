// SPDX-License-Identifier: Apache-2.0
// window.__ignis: what the page holds, for tests and for the curious. Nothing in the page reads it.

import type { Hud, PerLevel } from "./stream/protocol";
import type { Applied } from "./stream/session";

export interface PageHook {
  connected: boolean;
  connections: number;
  sequence: number;
  revision: number;
  checksum: string;
  counts: PerLevel;
  hud: Hud | null;
  snapshots: number;
  deltas: number;
  resyncs: number;
  errors: number;
  /** Texts whose content was not what it should be. */
  refusedTexts: number;
  bytes: number;
  /** As reported to the server, and as it confirmed. */
  viewRadius: number;
  servedRadius: number;
  /** performance.now() of the newest frame on the screen; how often was drawn. */
  lastFrameAt: number;
  drawn: number;
  /** The newest frames applied, each beside its announcement. */
  applied: Applied[];
  paths: { eskf: number; smoothed: number };
  keyframes: number;
  loops: { from: number; to: number; stage: string }[];
  loopClouds: number[];
  events: number;
  vehicle: [number, number, number];
  cameraTarget: [number, number, number];
  /** Counts and checksum of what lies on the graphics card. */
  audit: () => { counts: PerLevel; checksum: string };
  /** Where each loop can be clicked, CSS pixels in the window. */
  knobs: () => { from: number; to: number; x: number; y: number }[];
}

declare global {
  interface Window {
    __ignis: PageHook;
  }
}

export const KEPT_APPLIED = 2000;

export function makeHook({ audit, knobs }: Pick<PageHook, "audit" | "knobs">): PageHook {
  const hook: PageHook = {
    connected: false, connections: 0, sequence: 0, revision: 0, checksum: "", counts: [0, 0, 0], hud: null,
    snapshots: 0, deltas: 0, resyncs: 0, errors: 0, refusedTexts: 0, bytes: 0, viewRadius: 0, servedRadius: 0, lastFrameAt: 0, drawn: 0,
    applied: [], paths: { eskf: 0, smoothed: 0 }, keyframes: 0, loops: [], loopClouds: [0, 0], events: 0,
    vehicle: [0, 0, 0], cameraTarget: [0, 0, 0], audit, knobs,
  };
  window.__ignis = hook;
  return hook;
}
