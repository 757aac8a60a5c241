// SPDX-License-Identifier: Apache-2.0
// Draws a voxel as the three faces of its cube that the eye can see, from 8 bytes (stream/voxel_store.ts).

import { GLSL3, ShaderMaterial, Vector3, type IUniform } from "three";
import type { ColourMode } from "../settings";
import { AGE_RAMP, HEIGHT_RAMP, INTENSITY_RAMP, LEVEL_COLOURS, RAMP_STEPS } from "./palette";

/** Three faces of four corners each. */
export const FACE_INDICES = [0, 4, 8].flatMap((first) => [0, 1, 2, 0, 2, 3].map((corner) => first + corner));
const MODES: Record<ColourMode, number> = { height: 0, intensity: 1, level: 2, age: 3 };
const RAMPS: Record<ColourMode, [number, number, number][]> = {
  height: HEIGHT_RAMP, intensity: INTENSITY_RAMP, level: HEIGHT_RAMP, age: AGE_RAMP,
};

const VERTEX = /* glsl */ `
in uvec2 a_voxel;
uniform float u_cell;         // edge of a voxel [m]
uniform float u_level_light;
uniform vec3 u_level_colour;
uniform int u_mode;
uniform vec3 u_ramp[${RAMP_STEPS}];
uniform float u_low, u_high;  // heights of the ramp's ends [m]
uniform float u_cut;          // nothing above this height is drawn [m]
uniform uint u_tick;
uniform vec3 u_centre;        // the vehicle
uniform float u_fade_from, u_fade_to;
uniform float u_lift;         // towards white, where the background is bright
out vec3 v_colour;
out vec2 v_face;
out float v_fade;
out float v_pixels;           // of a voxel's edge on the screen
uniform float u_pixels_per_radian;

vec3 ramp(float t) {
  float scaled = clamp(t, 0.0, 1.0) * float(${RAMP_STEPS - 1});
  int low = min(int(scaled), ${RAMP_STEPS - 2});
  return mix(u_ramp[low], u_ramp[low + 1], scaled - float(low));
}

void main() {
  vec3 cell = vec3(a_voxel.x & 255u, (a_voxel.x >> 8) & 255u, (a_voxel.x >> 16) & 255u);
  vec3 origin = modelMatrix[3].xyz;
  vec3 centre = (cell + 0.5) * u_cell;
  vec3 eye = cameraPosition - origin;
  int axis = gl_VertexID / 4, corner = gl_VertexID % 4;
  float u = (corner == 1 || corner == 2) ? 1.0 : -1.0;
  float v = corner >= 2 ? 1.0 : -1.0;
  float side = eye[axis] > centre[axis] ? 1.0 : -1.0;
  vec3 offset = axis == 0 ? vec3(side, u, v) : axis == 1 ? vec3(u, side, v) : vec3(u, v, side);
  vec3 world = origin + centre;

  float t = u_mode == 0 ? (world.y - u_low) / max(u_high - u_low, 0.1)
      : u_mode == 1 ? float(a_voxel.x >> 24) / 255.0
      : log2(1.0 + 0.1 * float((u_tick - a_voxel.y) & 0xffffffu)) / log2(601.0);
  vec3 colour = u_mode == 2 ? u_level_colour : ramp(t);
  float shade = axis == 1 ? (side > 0.0 ? 1.0 : 0.5) : axis == 0 ? 0.80 : 0.66;
  v_colour = mix(colour, vec3(1.0), u_lift) * shade * u_level_light;
  v_face = vec2(u, v);
  v_fade = smoothstep(u_fade_from, u_fade_to, distance(world.xz, u_centre.xz));
  v_pixels = u_cell * u_pixels_per_radian / max(distance(eye, centre), 0.01);
  gl_Position = world.y > u_cut
      ? vec4(2.0, 2.0, 2.0, 1.0)
      : projectionMatrix * modelViewMatrix * vec4(centre + 0.5 * u_cell * offset, 1.0);
}`;

const FRAGMENT = /* glsl */ `
in vec3 v_colour;
in vec2 v_face;
in float v_fade;
in float v_pixels;
uniform vec3 u_background;
uniform float u_edge;
uniform float u_veil;         // 1: only a hint of the voxels is left
out vec4 colour;
void main() {
  // Darker towards the face's border: neighbours stay apart where they are large enough to be seen.
  vec2 inside = 0.5 * v_pixels * (1.0 - abs(v_face));
  float border = 1.0 - smoothstep(0.4, 1.6, min(inside.x, inside.y));
  vec3 lit = v_colour * (1.0 - u_edge * border * smoothstep(3.0, 9.0, v_pixels));
  colour = vec4(mix(lit, u_background, max(0.75 * v_fade, 0.82 * u_veil)), 1.0);
}`;

export type Uniforms = Record<string, IUniform>;

/** What all levels share; the values are set by their owners. */
export function sharedUniforms(): Uniforms {
  return {
    u_mode: { value: 0 },
    u_ramp: { value: HEIGHT_RAMP.map((colour) => new Vector3(...colour)) },
    u_low: { value: 0 },
    u_high: { value: 1 },
    u_cut: { value: 1e9 },
    u_tick: { value: 0 },
    u_centre: { value: new Vector3() },
    u_fade_from: { value: 1e6 },
    u_fade_to: { value: 2e6 },
    u_background: { value: new Vector3() },
    u_edge: { value: 0.3 },
    u_lift: { value: 0 },
    u_veil: { value: 0 },
    u_pixels_per_radian: { value: 1000 },
  };
}

export function setColourMode(uniforms: Uniforms, mode: ColourMode): void {
  uniforms.u_mode.value = MODES[mode];
  uniforms.u_ramp.value = RAMPS[mode].map((colour) => new Vector3(...colour));
}

export function voxelMaterial(shared: Uniforms, level: number, cell: number): ShaderMaterial {
  return new ShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    uniforms: {
      ...shared,
      u_cell: { value: cell },
      u_level_light: { value: [1, 0.86, 0.7][level] },
      u_level_colour: { value: new Vector3(...LEVEL_COLOURS[level]) },
    },
    // The shader chooses the faces, in either winding.
    side: 2,
  });
}
