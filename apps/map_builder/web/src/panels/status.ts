// SPDX-License-Identifier: Apache-2.0
// Shows the verdict of freshness.ts: pill, banner, greyed picture, and a spoken alarm when the vehicle is lost.

import { byId, setText } from "../dom";
import { judge, type Situation, type Verdict } from "./freshness";

export class StatusDisplay {
  private wasLost = false;
  private readonly situation: Situation = {
    connected: false, everConnected: false, retryInS: 0, attempt: 0, dataAgeS: null, health: [],
  };
  private retryAt = 0;
  private poseAt: number | null = null; // performance.now() at which the newest pose was made

  opened(): void {
    Object.assign(this.situation, { connected: true, everConnected: true, attempt: 0 });
    this.show();
  }

  closed(attempt: number, retryMs: number): void {
    Object.assign(this.situation, { connected: false, attempt });
    this.retryAt = performance.now() + retryMs;
    this.show();
  }

  /** Another server may have seen nothing yet. */
  setPoseAge(ageS: number | null): void {
    this.poseAt = ageS === null ? null : performance.now() - 1000 * ageS;
  }

  setHealth(health: Situation["health"]): void {
    this.situation.health = health;
  }

  /** To be called several times a second: ages grow without any message. */
  show(): Verdict {
    const now = performance.now();
    this.situation.retryInS = Math.max(0, (this.retryAt - now) / 1000);
    this.situation.dataAgeS = this.poseAt === null ? null : (now - this.poseAt) / 1000;
    const verdict = judge(this.situation);
    document.body.dataset.link = verdict.link;
    const pill = byId("tracking");
    setText(pill, verdict.tracking.text);
    pill.dataset.state = verdict.tracking.quality;
    const banner = byId("banner");
    banner.hidden = verdict.banner === null;
    if (verdict.banner) {
      banner.dataset.kind = verdict.banner.kind;
      setText(byId("banner-title"), verdict.banner.title);
      setText(byId("banner-text"), verdict.banner.text);
    }
    if (verdict.isLost !== this.wasLost) {
      this.wasLost = verdict.isLost;
      setText(byId("alarm"), verdict.isLost ? `Lost. ${verdict.banner?.text ?? ""}` : "Found again.");
    }
    return verdict;
  }

  get dataAgeS(): number | null {
    return this.situation.dataAgeS;
  }
}
