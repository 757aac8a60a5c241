// SPDX-License-Identifier: Apache-2.0
// The messages of docs/wire_format.md, as the server sends them. Keys that are not listed here are ignored.

export const PROTOCOL = "ignis.lio_map.v2";
export const LEVELS = 3;
export type PerLevel = [number, number, number];
export type Vector3 = [number, number, number];

export interface Hello {
  type: "hello";
  version: number;
  server: string;
  session: number;
  revision: number;
  cell_m: PerLevel;
  window_m: PerLevel;
  max_view_m: number;
  rate_hz: number;
}

/** Announces the binary message that follows; counts and checksum are those after it has been applied. */
export interface FrameAnnouncement {
  type: "frame";
  kind: "snapshot" | "delta";
  sequence: number;
  base?: number;
  revision: number;
  counts: PerLevel;
  checksum: string;
  utime: number;
}

export interface HudState {
  utime: number;
  session: number;
  age_s: number;
  position: Vector3;
  quaternion: [number, number, number, number];
  yaw_deg: number;
  pitch_deg: number;
  roll_deg: number;
  right_mps: number;
  up_mps: number;
  forward_mps: number;
}

export interface HudScan {
  applied: boolean;
  reason: string;
  points: number;
  matched: number;
  mean_innovation_m: number;
  correction_m: number;
  total_applied: number;
  total_rejected: number;
}

export interface HudLoop {
  keyframes: number;
  candidates: number;
  accepted: boolean;
  reason: string;
  correction_m: number;
  mean_residual_m: number;
  total_accepted: number;
  total_withdrawn: number;
}

export interface HudMap {
  revision: number;
  voxels: PerLevel;
  bytes: number;
  keyframes: number;
  rebuilds: number;
  rebuilding: boolean;
  messages_lost: number;
  clients: number;
}

export interface ProcessHealth {
  process: string;
  state: string;
  reason: string;
}

export interface Hud {
  type: "hud";
  state: HudState | null;
  scan: HudScan | null;
  loop: HudLoop | null;
  map: HudMap;
  health?: ProcessHealth[];
  link?: { lost: number; received: number; age_s: number | null };
}

export type LoopStage = "candidate" | "verified" | "on_trial" | "kept" | "withdrawn";

export interface Loop {
  from: number;
  to: number;
  stage: LoopStage;
  reason: string;
  residual_m: number | null;
  matched: number | null;
  overlap: number | null;
  correction_m: number | null;
  chi_square: number | null;
  chi_square_bound: number | null;
}

export interface MapEvent {
  type: "event";
  utime: number;
  kind: string;
  text: string;
  level: "info" | "warn" | "error";
  position?: Vector3;
}

export interface Keyframes {
  type: "keyframes";
  revision: number;
  ids: number[];
  positions: number[];
  full?: boolean;
}

export interface LoopClouds {
  type: "loop_clouds";
  from: number;
  to: number;
  from_points: number;
  to_points: number;
}

export type ServerText =
  | Hello
  | FrameAnnouncement
  | Hud
  | MapEvent
  | Keyframes
  | LoopClouds
  | { type: "loops"; list: Loop[] }
  | { type: "view"; radius: number }
  | { type: "command"; command: string; from: number; to: number; sent: boolean }
  | { type: "error"; code: string; reason: string };

export type ClientText =
  | { view: number }
  | { resync: true }
  | { loop: { from: number; to: number } }
  | { veto: { from: number; to: number } }
  | { withdraw: { from: number; to: number } };
