// SPDX-License-Identifier: Apache-2.0
// Loops as arcs between their keyframes, coloured by stage, each with a knob at its top that can be picked.

import { Group, type PerspectiveCamera, Vector3 as ThreeVector } from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import type { LoopStage, Vector3 } from "../stream/protocol";
import { Discs } from "./discs";
import { STAGE_COLOURS, rgb } from "./palette";

const STEPS = 16;

export interface Arc {
  fromId: number;
  toId: number;
  from: Vector3;
  to: Vector3;
  stage: LoopStage;
}

/** Points along the arc from `from` (t 0) to `to` (t 1): higher in the middle. */
export function arcPoint({ from, to }: Pick<Arc, "from" | "to">, t: number): Vector3 {
  const height = 1.0 + 0.25 * Math.hypot(to[0] - from[0], to[2] - from[2]);
  const lift = 4 * height * t * (1 - t);
  return [0, 1, 2].map((i) => from[i] + (to[i] - from[i]) * t + (i === 1 ? lift : 0)) as Vector3;
}

export class LoopArcs {
  readonly group = new Group();
  private arcs: Arc[] = [];
  private selected: string | null = null;
  private readonly material = new LineMaterial({ linewidth: 2.5, vertexColors: true, depthTest: false, transparent: true });
  private readonly line = new LineSegments2(new LineSegmentsGeometry(), this.material);
  private readonly knobs = new Discs(13, 1);
  private readonly halo = new Discs(23, 0.55);

  constructor() {
    this.line.frustumCulled = false;
    this.line.renderOrder = 3;
    this.knobs.points.renderOrder = 5;
    this.halo.points.renderOrder = 4;
    this.group.add(this.line, this.halo.points, this.knobs.points);
    this.draw();
  }

  set(arcs: Arc[]): void {
    this.arcs = arcs;
    this.draw();
  }

  select(from: number | null, to: number | null): void {
    this.selected = from === null ? null : `${from}-${to}`;
    this.draw();
  }

  setTheme(rim: Vector3): void {
    this.knobs.setRim(rim);
  }

  setPixelRatio(ratio: number): void {
    this.knobs.setPixelRatio(ratio);
    this.halo.setPixelRatio(ratio);
  }

  private draw(): void {
    const positions: number[] = [], colours: number[] = [], tops: number[] = [], knobColours: Vector3[] = [];
    let halo: Vector3[] = [];
    for (const arc of this.arcs) {
      const colour = rgb(STAGE_COLOURS[arc.stage]);
      const linear = colour.map((value) => value ** 2.2);
      for (let i = 0; i < STEPS; i++) {
        positions.push(...arcPoint(arc, i / STEPS), ...arcPoint(arc, (i + 1) / STEPS));
        colours.push(...linear, ...linear);
      }
      const top = arcPoint(arc, 0.5);
      tops.push(...top);
      knobColours.push(colour);
      if (this.selected === `${arc.fromId}-${arc.toId}`) halo = [top];
    }
    this.line.visible = this.arcs.length > 0;
    if (this.line.visible) {
      this.line.geometry.dispose();
      this.line.geometry = new LineSegmentsGeometry();
      this.line.geometry.setPositions(positions);
      this.line.geometry.setColors(colours);
    }
    this.knobs.set(tops, knobColours);
    this.halo.set(halo.flat(), [[1, 1, 1]]);
  }

  /** Where the knobs in front of the camera are drawn, CSS pixels from the upper left corner of a canvas of that size. */
  knobsOn(width: number, height: number, camera: PerspectiveCamera): { arc: Arc; x: number; y: number }[] {
    const drawn = [];
    for (const arc of this.arcs) {
      const top = new ThreeVector(...arcPoint(arc, 0.5)).project(camera);
      if (top.z <= 1) drawn.push({ arc, x: ((top.x + 1) / 2) * width, y: ((1 - top.y) / 2) * height });
    }
    return drawn;
  }

  /** The arc whose knob is drawn nearest to the point, at most `reach` CSS pixels away. */
  pick(x: number, y: number, width: number, height: number, camera: PerspectiveCamera, reach: number): Arc | null {
    let best: Arc | null = null;
    let nearest = reach;
    for (const knob of this.knobsOn(width, height, camera)) {
      const distance = Math.hypot(knob.x - x, knob.y - y);
      if (distance < nearest) [best, nearest] = [knob.arc, distance];
    }
    return best;
  }
}
