// SPDX-License-Identifier: Apache-2.0
// The vehicle's glyph, an arrow that points forward (-Z of the body), and rings where the map's windows end.

import {
  BufferGeometry, DirectionalLight, ExtrudeGeometry, Float32BufferAttribute, Group, HemisphereLight, LineBasicMaterial,
  LineLoop, Mesh, MeshLambertMaterial, Quaternion, Shape, Vector3,
} from "three";
import type { PerLevel } from "../stream/protocol";

const CORNERS: [number, number][] = [[0, 0.95], [0.55, -0.6], [0, -0.28], [-0.55, -0.6]];
const RING_STEPS = 128;
const EASE_S = 0.09;
const FARTHEST_GLIDE_M = 5;

function arrow(): ExtrudeGeometry {
  const shape = new Shape();
  CORNERS.forEach(([x, y], i) => (i === 0 ? shape.moveTo(x, y) : shape.lineTo(x, y)));
  const geometry = new ExtrudeGeometry(shape, { depth: 0.18, bevelEnabled: false });
  geometry.rotateX(-Math.PI / 2); // the shape's y becomes -Z, its depth Y
  return geometry;
}

export class VehicleGlyph {
  readonly group = new Group();
  readonly rings = new Group();
  private readonly body = new Group();
  private readonly material = new MeshLambertMaterial();
  private readonly ringMaterial = new LineBasicMaterial({ transparent: true, opacity: 0.4 });
  private readonly targetPosition = new Vector3();
  private readonly targetRotation = new Quaternion();
  private readonly glides = !matchMedia("(prefers-reduced-motion: reduce)").matches;
  private isPlaced = false;

  constructor() {
    const mesh = new Mesh(arrow(), this.material);
    const ghost = new Mesh(mesh.geometry, new MeshLambertMaterial({ transparent: true, opacity: 0.35, depthTest: false }));
    ghost.material.color = this.material.color;
    ghost.renderOrder = 2;
    this.body.add(mesh, ghost);
    const sun = new DirectionalLight(0xffffff, 2.2);
    sun.position.set(0.4, 1, 0.6);
    this.group.add(this.body, this.rings, new HemisphereLight(0xffffff, 0x8899aa, 1.6), sun, sun.target);
    this.group.visible = false;
  }

  setColours(vehicle: number, ring: number): void {
    this.material.color.setHex(vehicle);
    this.ringMaterial.color.setHex(ring);
  }

  /** Radii of the levels' windows [m]. */
  setRings(radii: PerLevel): void {
    for (const ring of this.rings.children) (ring as LineLoop).geometry.dispose();
    this.rings.clear();
    for (const radius of radii) {
      const points = Array.from({ length: RING_STEPS }, (_, i) => (2 * Math.PI * i) / RING_STEPS)
        .flatMap((angle) => [radius * Math.cos(angle), 0, radius * Math.sin(angle)]);
      const geometry = new BufferGeometry();
      geometry.setAttribute("position", new Float32BufferAttribute(points, 3));
      this.rings.add(new LineLoop(geometry, this.ringMaterial));
    }
  }

  moveTo(position: number[], [w, x, y, z]: number[]): void {
    this.targetPosition.set(position[0], position[1], position[2]);
    this.targetRotation.set(x, y, z, w);
    this.group.visible = true;
  }

  get position(): Vector3 {
    return this.body.position;
  }

  /** Glides towards the newest pose. Returns whether it moved. */
  advance(seconds: number): boolean {
    const gap = this.body.position.distanceTo(this.targetPosition);
    const turn = this.body.quaternion.angleTo(this.targetRotation);
    if (this.isPlaced && gap < 1e-4 && turn < 1e-4) return false;
    const share = this.isPlaced && this.glides && gap < FARTHEST_GLIDE_M ? 1 - Math.exp(-seconds / EASE_S) : 1;
    this.isPlaced = this.group.visible;
    this.body.position.lerp(this.targetPosition, share);
    this.body.quaternion.slerp(this.targetRotation, share);
    this.rings.position.copy(this.body.position);
    return true;
  }
}
