// SPDX-License-Identifier: Apache-2.0
// The figures at the left: what the server's "hud" text says, and what the page itself holds.

import { byId, byTestId, count, number, setText } from "../dom";
import type { Hud, HudState, PerLevel, ProcessHealth } from "../stream/protocol";
import { qualityOf } from "./freshness";

/** A velocity that fills its bar [m/s]. */
const FULL_BAR_MPS = 2;
const PIXELS_PER_DEGREE = 1.3;

export class HudPanel {
  private readonly fields = new Map<string, HTMLElement>();

  private set(name: string, text: string, quality = ""): void {
    let field = this.fields.get(name);
    if (!field) this.fields.set(name, (field = byTestId(name)));
    setText(field, text);
    for (const word of ["good", "warn", "bad"]) field.classList.toggle(word, word === quality);
  }

  show(hud: Hud): void {
    if (hud.state) this.showState(hud.state);
    if (hud.scan) {
      const { applied, reason, matched, points } = hud.scan;
      this.set("hud-scan", applied ? "applied" : reason || "not applied", applied ? "good" : "warn");
      this.set("hud-matched", `${count(matched)} of ${count(points)}`);
      this.set("hud-applied", `${count(hud.scan.total_applied)}, refused ${count(hud.scan.total_rejected)}`);
      share(byId("matched-bar"), points > 0 ? matched / points : 0);
    }
    if (hud.loop) {
      const { accepted, reason, correction_m, total_accepted, total_withdrawn } = hud.loop;
      this.set("hud-loop", accepted ? `closed, ${number(correction_m, 2)} m` : "searching", accepted ? "good" : "");
      this.set("hud-loop-reason", accepted ? "" : reason);
      this.set("hud-loops", count(total_accepted) + (total_withdrawn ? `, withdrawn ${count(total_withdrawn)}` : ""));
    }
    this.set("hud-keyframes", count(hud.map.keyframes));
    const lost = hud.link?.lost ?? hud.map.messages_lost;
    const received = hud.link?.received;
    this.set("hud-lost", received === undefined ? count(lost) : `${count(lost)} of ${count(received + lost)}`, lost > 0 ? "warn" : "good");
    this.showProcesses(hud.health ?? []);
  }

  private showState(state: HudState): void {
    this.set("hud-yaw", number(state.yaw_deg, 1, "°"));
    this.set("hud-pitch", number(state.pitch_deg, 1, "°"));
    this.set("hud-roll", number(state.roll_deg, 1, "°"));
    for (const [name, value] of [["forward", state.forward_mps], ["right", state.right_mps], ["up", state.up_mps]] as const) {
      this.set(`hud-${name}`, number(value, 2));
      share(byId(`bar-${name}`), Math.max(-1, Math.min(1, value / FULL_BAR_MPS)));
    }
    const drop = Math.max(-40, Math.min(40, state.pitch_deg * PIXELS_PER_DEGREE));
    byId<SVGGElement>("dial-horizon").setAttribute("transform", `rotate(${-state.roll_deg}) translate(0 ${drop})`);
    // Yaw is positive to the left: where the map's forward lies, seen from the vehicle.
    byId<SVGGElement>("dial-heading").setAttribute("transform", `rotate(${state.yaw_deg})`);
  }

  private showProcesses(health: ProcessHealth[]): void {
    const list = byId("processes");
    while (list.children.length > health.length) list.lastElementChild?.remove();
    while (list.children.length < health.length) {
      const row = document.createElement("li");
      row.append(document.createElement("span"), document.createElement("span"));
      row.lastElementChild!.className = "why";
      list.append(row);
    }
    health.forEach(({ process, state, reason }, i) => {
      const row = list.children[i] as HTMLElement;
      row.dataset.state = qualityOf(state);
      setText(row.children[0], process);
      const why = reason && reason.toUpperCase() !== state.toUpperCase() ? reason : "";
      setText(row.children[1], state.toUpperCase() === "OK" ? "OK" : why || state);
    });
  }

  /** What the page holds after the newest frame, and whether it equals what the server announced. */
  showMap(revision: number, counts: PerLevel, fits: boolean): void {
    this.set("hud-revision", `revision ${revision}`);
    counts.forEach((value, level) => this.set(`voxels-${level}`, count(value)));
    this.set("verified", fits ? "yes" : "NO", fits ? "good" : "bad");
  }

  showAge(ageS: number | null): void {
    this.set("hud-link", ageS === null ? "–" : `${number(ageS, 1)} s old`, ageS !== null && ageS > 2 ? "warn" : "");
  }
}

/** -1..1 of a bar's length. */
function share(bar: HTMLElement, value: number): void {
  bar.style.setProperty("--share", value.toFixed(3));
}
