// SPDX-License-Identifier: Apache-2.0
// The two clouds of the chosen loop: where they lie on one another the loop is right.

import { BufferAttribute, BufferGeometry, Group, Points, PointsMaterial } from "three";

export class LoopCloudPoints {
  readonly group = new Group();
  readonly counts = [0, 0];
  private readonly clouds = [0, 1].map(() => {
    const material = new PointsMaterial({ size: 3, sizeAttenuation: false, depthTest: false, transparent: true, opacity: 0.9 });
    const points = new Points(new BufferGeometry(), material);
    points.frustumCulled = false;
    points.renderOrder = 2;
    return points;
  });

  constructor() {
    this.group.add(...this.clouds);
    this.group.visible = false;
  }

  set(from: Float32Array, to: Float32Array): void {
    [from, to].forEach((positions, i) => {
      this.clouds[i].geometry.dispose();
      this.clouds[i].geometry = new BufferGeometry();
      this.clouds[i].geometry.setAttribute("position", new BufferAttribute(positions, 3));
      this.counts[i] = positions.length / 3;
    });
    this.group.visible = true;
  }

  clear(): void {
    this.set(new Float32Array(), new Float32Array());
    this.group.visible = false;
  }

  setColours(from: number, to: number): void {
    this.clouds[0].material.color.setHex(from);
    this.clouds[1].material.color.setHex(to);
  }
}
