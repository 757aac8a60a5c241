// SPDX-License-Identifier: Apache-2.0
// Keyframes at their corrected positions; the server sends those that are new or moved.

import type { Keyframes, Vector3 } from "../stream/protocol";
import { Discs } from "./discs";

export class KeyframeMarkers {
  readonly discs = new Discs(7, 0.9);
  private readonly positions = new Map<number, Vector3>();
  private colour: Vector3 = [1, 1, 1];

  apply(message: Keyframes): void {
    if (message.full) this.positions.clear();
    message.ids.forEach((id, i) => this.positions.set(id, message.positions.slice(3 * i, 3 * i + 3) as Vector3));
    this.draw();
  }

  clear(): void {
    this.positions.clear();
    this.draw();
  }

  setColour(colour: Vector3, rim: Vector3): void {
    this.colour = colour;
    this.discs.setRim(rim);
    this.draw();
  }

  get count(): number {
    return this.positions.size;
  }

  position(id: number): Vector3 | undefined {
    return this.positions.get(id);
  }

  private draw(): void {
    this.discs.set([...this.positions.values()].flat(), [this.colour]);
  }
}
