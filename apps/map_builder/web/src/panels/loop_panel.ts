// SPDX-License-Identifier: Apache-2.0
// The list of loops, the chosen one's figures, and the commands to the back end.

import { byId, byTestId, count, number, setText } from "../dom";
import type { Quality } from "./freshness";
import type { ClientText, Loop, LoopStage } from "../stream/protocol";
import { confirmed } from "./dialogs";

const STAGE_TEXT: Record<LoopStage, string> = {
  candidate: "candidate", verified: "verified", on_trial: "on trial", kept: "kept", withdrawn: "withdrawn",
};
const STAGE_QUALITY: Record<LoopStage, Quality> = {
  candidate: "idle", verified: "idle", on_trial: "warn", kept: "good", withdrawn: "bad",
};
const COMMANDS = {
  withdraw: { title: "Withdraw this loop?", text: "It leaves the graph, and the map moves back. The back end may find it again." },
  veto: { title: "Veto this loop?", text: "It leaves the graph, and the back end never closes it again." },
};
type Command = keyof typeof COMMANDS;

export class LoopPanel {
  /** The chosen loop, or null; the caller draws it. */
  onChosen: (loop: Loop | null) => void = () => {};
  onGoTo: (loop: Loop) => void = () => {};
  onOpened: () => void = () => {};
  private loops: Loop[] = [];
  private chosen: { from: number; to: number } | null = null;
  private readonly panel = byId("loops");

  constructor(private readonly send: (message: ClientText) => void) {
    this.panel.querySelector(".close")!.addEventListener("click", () => this.setOpen(false));
    byId("show-loops").addEventListener("click", () => this.setOpen(!this.isOpen));
    byId("go-to-loop").addEventListener("click", () => {
      const loop = this.find(this.chosen);
      if (loop) this.onGoTo(loop);
    });
    for (const command of ["withdraw", "veto"] as const) {
      byId(command).addEventListener("click", () => void this.command(command));
    }
    this.drawList();
  }

  get isOpen(): boolean {
    return !this.panel.hidden;
  }

  setOpen(isOpen: boolean): void {
    this.panel.hidden = !isOpen;
    byId("show-loops").setAttribute("aria-expanded", String(isOpen));
    if (isOpen) this.onOpened();
    else if (this.chosen) this.choose(null);
  }

  set(loops: Loop[]): void {
    this.loops = loops;
    this.drawList();
    this.drawDetail();
  }

  choose(which: { from: number; to: number } | null): void {
    const loop = this.find(which);
    this.chosen = loop ? { from: loop.from, to: loop.to } : null;
    for (const name of ["loop-from-points", "loop-to-points"]) setText(byTestId(name), "–");
    setText(byId("loop-answer"), "");
    if (loop) {
      if (!this.isOpen) this.setOpen(true);
      this.chosen = { from: loop.from, to: loop.to };
      this.send({ loop: this.chosen });
    }
    this.drawList();
    this.drawDetail();
    this.onChosen(loop);
  }

  showPoints(from: number, to: number): void {
    setText(byTestId("loop-from-points"), count(from));
    setText(byTestId("loop-to-points"), count(to));
  }

  isChosen(from: number, to: number): boolean {
    return this.chosen?.from === from && this.chosen.to === to;
  }

  showAnswer(text: string): void {
    setText(byId("loop-answer"), text);
  }

  private find(which: { from: number; to: number } | null): Loop | null {
    return this.loops.find(({ from, to }) => from === which?.from && to === which.to) ?? null;
  }

  private async command(command: Command): Promise<void> {
    const loop = this.chosen;
    if (!loop) return;
    const { title, text } = COMMANDS[command];
    const action = command === "veto" ? "Veto" : "Withdraw";
    if (!(await confirmed(title, `Keyframes ${loop.from} and ${loop.to}. ${text}`, action))) return;
    this.send(command === "veto" ? { veto: loop } : { withdraw: loop });
    this.showAnswer("Sending …");
  }

  private drawList(): void {
    const list = byId("loop-list");
    const order: LoopStage[] = ["kept", "on_trial", "verified", "withdrawn", "candidate"];
    const sorted = [...this.loops].sort((a, b) => order.indexOf(a.stage) - order.indexOf(b.stage) || b.from - a.from);
    const rows = sorted.map((loop) => {
      const row = document.createElement("li");
      const button = document.createElement("button");
      button.type = "button";
      button.dataset.stage = loop.stage;
      button.setAttribute("aria-pressed", String(this.isChosen(loop.from, loop.to)));
      const [dot, name, note] = ["i", "span", "small"].map((tag) => document.createElement(tag));
      dot.className = "dot";
      name.textContent = `${loop.from} → ${loop.to}`;
      note.textContent = STAGE_TEXT[loop.stage];
      button.append(dot, name, note);
      button.addEventListener("click", () => this.choose(this.isChosen(loop.from, loop.to) ? null : loop));
      row.append(button);
      return row;
    });
    const focused = list.contains(document.activeElement) ? document.activeElement!.textContent : null;
    if (rows.length > 0) list.replaceChildren(...rows);
    else list.innerHTML = '<li class="none">None closed yet</li>';
    if (focused) [...list.querySelectorAll("button")].find((button) => button.textContent === focused)?.focus();
  }

  private drawDetail(): void {
    const loop = this.find(this.chosen);
    byId("loop-detail").hidden = loop === null;
    if (!loop) return;
    setText(byId("loop-title"), `${loop.from} → ${loop.to}`);
    const stage = byId("loop-stage");
    setText(stage, STAGE_TEXT[loop.stage]);
    stage.dataset.state = STAGE_QUALITY[loop.stage];
    setText(byId("loop-reason"), loop.reason);
    const percent = (value: number | null): string => (value === null ? "–" : number(100 * value, 0, " %"));
    const hasTest = loop.chi_square_bound !== null && loop.chi_square_bound > 0;
    const figures: Record<string, string> = {
      "loop-residual": loop.residual_m === null ? "–" : number(1000 * loop.residual_m, 1, " mm"),
      "loop-matched": percent(loop.matched),
      "loop-overlap": percent(loop.overlap),
      "loop-correction": number(loop.correction_m, 3, " m"),
      "loop-chi": hasTest ? `${number(loop.chi_square, 1)} of ${number(loop.chi_square_bound, 1)}` : "–",
    };
    for (const [name, text] of Object.entries(figures)) setText(byTestId(name), text);
    byId<HTMLButtonElement>("withdraw").disabled = !["on_trial", "kept"].includes(loop.stage);
  }
}
