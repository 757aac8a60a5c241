// SPDX-License-Identifier: Apache-2.0
// A driven path: a line of constant width on the screen, drawn over the voxels' hidden parts more faintly.

import { Group } from "three";
import { Line2 } from "three/addons/lines/Line2.js";
import { LineGeometry } from "three/addons/lines/LineGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";

const HIDDEN_OPACITY = 0.28;

export class PathLine {
  readonly group = new Group();
  private readonly materials: [LineMaterial, LineMaterial];
  private lines: Line2[] = [];

  constructor(width: number) {
    const visible = new LineMaterial({ linewidth: width });
    const hidden = new LineMaterial({ linewidth: width, depthTest: false, transparent: true, opacity: HIDDEN_OPACITY });
    this.materials = [visible, hidden];
  }

  setColour(hex: number): void {
    for (const material of this.materials) material.color.setHex(hex);
  }

  /** Points xyz xyz ..., each joined to the next. */
  setPoints(points: Float32Array): void {
    for (const line of this.lines) this.group.remove(line);
    this.lines[0]?.geometry.dispose();
    this.lines = [];
    if (points.length < 6) return;
    const geometry = new LineGeometry();
    geometry.setPositions(points);
    this.lines = this.materials.map((material, i) => {
      const line = new Line2(geometry, material);
      line.frustumCulled = false; // paths go everywhere, and their spheres cost more than drawing them
      line.renderOrder = 2 - i;
      return line;
    });
    this.group.add(...this.lines);
  }
}
