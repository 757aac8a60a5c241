// SPDX-License-Identifier: Apache-2.0
// Round markers of constant size on the screen, each with its colour.

import { BufferAttribute, BufferGeometry, Color, GLSL3, Points, ShaderMaterial } from "three";
import type { Vector3 } from "../stream/protocol";

const VERTEX = /* glsl */ `
in vec3 a_colour;
uniform float u_size;
out vec3 v_colour;
void main() {
  v_colour = a_colour;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  gl_PointSize = u_size;
}`;

const FRAGMENT = /* glsl */ `
in vec3 v_colour;
uniform vec3 u_rim;
uniform float u_size, u_opacity;
out vec4 colour;
void main() {
  float radius = length(2.0 * gl_PointCoord - 1.0), pixel = 2.0 / u_size;
  float cover = 1.0 - smoothstep(1.0 - 1.5 * pixel, 1.0, radius);
  if (cover <= 0.0) discard;
  float core = 1.0 - smoothstep(1.0 - 2.6 * pixel, 1.0 - 1.4 * pixel, radius);
  colour = vec4(mix(u_rim, v_colour, core), cover * u_opacity);
}`;

export class Discs {
  readonly points: Points<BufferGeometry, ShaderMaterial>;

  constructor(private readonly diameter: number, opacity: number) {
    const material = new ShaderMaterial({
      glslVersion: GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT, transparent: true, depthTest: false,
      uniforms: { u_size: { value: diameter }, u_opacity: { value: opacity }, u_rim: { value: new Color() } },
    });
    this.points = new Points(new BufferGeometry(), material);
    this.points.frustumCulled = false;
    this.points.renderOrder = 3;
  }

  /** Sizes are in CSS pixels; a dense screen has more of its own. */
  setPixelRatio(ratio: number): void {
    this.points.material.uniforms.u_size.value = this.diameter * ratio;
  }

  setRim(colour: Vector3): void {
    this.points.material.uniforms.u_rim.value.setRGB(...colour, "srgb-linear");
  }

  /** Positions xyz xyz ... and one sRGB colour a disc, or one for all. */
  set(positions: ArrayLike<number>, colours: Vector3[]): void {
    const count = positions.length / 3;
    const rgb = new Float32Array(3 * count);
    for (let i = 0; i < count; i++) rgb.set(colours[Math.min(i, colours.length - 1)], 3 * i);
    this.points.geometry.dispose();
    this.points.geometry = new BufferGeometry();
    this.points.geometry.setAttribute("position", new BufferAttribute(Float32Array.from(positions), 3));
    this.points.geometry.setAttribute("a_colour", new BufferAttribute(rgb, 3));
  }
}
