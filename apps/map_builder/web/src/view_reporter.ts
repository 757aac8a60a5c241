// SPDX-License-Identifier: Apache-2.0
// Tells the server how far the picture reaches, when that has changed by enough, and not too often.

const PAUSE_MS = 250;
const SHARE = 0.05;

export class ViewReporter {
  private reported = 0;
  private at = -Infinity;

  constructor(private readonly send: (radius: number) => void) {}

  /** A new connection knows nothing yet. */
  forget(): void {
    this.reported = 0;
    this.at = -Infinity;
  }

  /** Returns the radius that the server was told last. */
  update(radius: number, largest: number, now: number): number {
    const wanted = Math.round(10 * Math.min(largest, Math.max(1, radius))) / 10;
    if (Math.abs(wanted - this.reported) > SHARE * this.reported && now - this.at >= PAUSE_MS) {
      this.send(wanted);
      this.reported = wanted;
      this.at = now;
    }
    return this.reported;
  }
}
