// SPDX-License-Identifier: Apache-2.0
// Colours of the picture, sRGB 0..1 as the shaders write them. The panels' colours stand in view.css.

import type { LoopStage, Vector3 } from "../stream/protocol";
import type { Theme } from "../settings";

export function rgb(hex: number): Vector3 {
  return [(hex >> 16) / 255, ((hex >> 8) & 255) / 255, (hex & 255) / 255];
}

/** Low to high: even steps of lightness, so that height reads in greyscale too. */
export const HEIGHT_RAMP = [0x32408f, 0x2a6fb0, 0x1f9e9e, 0x6cc07a, 0xe3c95b, 0xf6ece0].map(rgb);
/** Weak to strong reflection. */
export const INTENSITY_RAMP = [0x2a2440, 0x5b3a73, 0x9c4f7a, 0xd9776a, 0xf2b277, 0xfff3d0].map(rgb);
/** New to old. */
export const AGE_RAMP = [0xfff1b8, 0xf7b267, 0xd8736b, 0x8a5a83, 0x4f5479, 0x3b4863].map(rgb);
export const RAMP_STEPS = 6;
/** Local, mid, coarse. */
export const LEVEL_COLOURS = [0x5cc8f2, 0x8f86e8, 0xb08a64].map(rgb);

export const STAGE_COLOURS: Record<LoopStage, number> = {
  candidate: 0x8894a5,
  verified: 0x4fb3ff,
  on_trial: 0xffc14d,
  kept: 0x4fd694,
  withdrawn: 0xff6b6b,
};

export interface SceneColours {
  background: number;
  smoothed: number;
  eskf: number;
  keyframe: number;
  band: number;
  vehicle: number;
  cloudFrom: number;
  cloudTo: number;
  /** Strength of the darkened edges of voxels; how far their colours go towards white. */
  edge: number;
  lift: number;
}

export const SCENE_COLOURS: Record<Theme, SceneColours> = {
  dark: {
    background: 0x0c1118, smoothed: 0x58f0a0, eskf: 0xff9b52, keyframe: 0xd8fbe8, band: 0x8fb4d8, vehicle: 0xffffff,
    cloudFrom: 0xff5fd2, cloudTo: 0x53e3ff, edge: 0.3, lift: 0,
  },
  light: {
    background: 0xe9edf2, smoothed: 0x00864b, eskf: 0xd45500, keyframe: 0x004d2c, band: 0x51657a, vehicle: 0x10161f,
    cloudFrom: 0xc4008f, cloudTo: 0x0070c9, edge: 0.26, lift: 0.22,
  },
};

/** The colour of a ramp at t in 0..1: what the shader does, for keys and tests. */
export function rampColour(ramp: Vector3[], t: number): Vector3 {
  const scaled = Math.min(Math.max(t, 0), 1) * (ramp.length - 1);
  const low = Math.min(Math.floor(scaled), ramp.length - 2);
  return ramp[low].map((value, i) => value + (ramp[low + 1][i] - value) * (scaled - low)) as Vector3;
}

/** 0 for a voxel that has just arrived, 1 for one of ten minutes and more; seconds to minutes are spread evenly. */
export function ageFraction(seconds: number): number {
  return Math.min(1, Math.log2(1 + seconds) / Math.log2(601));
}
