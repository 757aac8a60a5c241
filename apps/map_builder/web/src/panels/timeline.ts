// SPDX-License-Identifier: Apache-2.0
// What happened, along a line of time. A mark tells its event; choosing it moves the camera to where the vehicle was.

import { byId, setText } from "../dom";
import type { MapEvent, Vector3 } from "../stream/protocol";

/** As many as the server keeps. */
const KEPT_EVENTS = 200;
const KEPT_TRACE = 7200;
const TRACE_STEP_US = 1_000_000;
const FARTHEST_TRACE_US = 3_000_000;

const FILTERS: { label: string; kinds: string[] }[] = [
  { label: "Scans", kinds: ["scan_rejected"] },
  { label: "Loops", kinds: ["loop"] },
  { label: "Map", kinds: ["rebuild", "keyframe"] },
  { label: "State", kinds: ["lost", "found", "session", "health"] },
];

/** Where the vehicle was, once a second. */
export class PositionTrace {
  private entries: { utime: number; position: Vector3 }[] = [];

  add(utime: number, position: Vector3): void {
    const last = this.entries.at(-1);
    if (last && utime < last.utime) this.entries = []; // a new log or a restarted clock
    else if (last && utime - last.utime < TRACE_STEP_US) return;
    this.entries.push({ utime, position });
    if (this.entries.length > KEPT_TRACE) this.entries.shift();
  }

  at(utime: number): Vector3 | null {
    let best: { utime: number; position: Vector3 } | null = null;
    for (const entry of this.entries) {
      if (!best || Math.abs(entry.utime - utime) < Math.abs(best.utime - utime)) best = entry;
    }
    return best && Math.abs(best.utime - utime) <= FARTHEST_TRACE_US ? best.position : null;
  }
}

export class Timeline {
  readonly trace = new PositionTrace();
  onChosen: (position: Vector3) => void = () => {};
  private events: MapEvent[] = [];
  private chosen: MapEvent | null = null;
  private readonly hidden = new Set<string>(["keyframe"]);
  private readonly track = byId("event-track");
  private isDrawn = true;
  private now = 0;

  constructor() {
    for (const { label, kinds } of FILTERS) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = label;
      button.setAttribute("aria-pressed", "true");
      button.addEventListener("click", () => {
        const isShown = button.getAttribute("aria-pressed") !== "true";
        button.setAttribute("aria-pressed", String(isShown));
        for (const kind of kinds) isShown ? this.hidden.delete(kind) : this.hidden.add(kind);
        this.isDrawn = false;
      });
      byId("event-filters").append(button);
    }
    this.track.addEventListener("keydown", (event) => this.step(event));
    this.describe(null);
  }

  clear(): void {
    this.events = [];
    this.chosen = null;
    this.isDrawn = false;
  }

  add(event: MapEvent): void {
    this.events.push(event);
    // What happened before the first measurement has no time of its own.
    const first = this.events.find(({ utime }) => utime > 0)?.utime ?? 0;
    for (const each of this.events) each.utime = Math.max(each.utime, first);
    if (this.events.length > KEPT_EVENTS) this.events.shift();
    this.isDrawn = false;
  }

  setNow(utime: number): void {
    this.now = utime;
  }

  get count(): number {
    return this.events.length;
  }

  /** Called a few times a second: many events may come at once. */
  draw(): void {
    const shown = this.events.filter(({ kind }) => !this.hidden.has(kind));
    if (!this.isDrawn) this.makeMarks(shown);
    this.isDrawn = true;
    const first = shown[0]?.utime ?? this.now;
    const span = Math.max(1e6, Math.max(this.now, shown.at(-1)?.utime ?? 0) - first);
    for (const mark of this.track.children as HTMLCollectionOf<HTMLElement>) {
      mark.style.left = `${((100 * (Number(mark.dataset.utime) - first)) / span).toFixed(2)}%`;
    }
    this.describe(this.chosen ?? shown.at(-1) ?? null);
  }

  private makeMarks(shown: MapEvent[]): void {
    const focused = (document.activeElement as HTMLElement | null)?.dataset.utime;
    this.track.replaceChildren(...shown.map((event) => {
      const mark = document.createElement("button");
      mark.type = "button";
      Object.assign(mark.dataset, { utime: String(event.utime), kind: event.kind, level: event.level });
      mark.setAttribute("aria-label", `${clock(event.utime, this.events[0].utime)} ${event.text}`);
      mark.title = event.text;
      mark.setAttribute("aria-current", String(event === this.chosen));
      mark.tabIndex = event === (this.chosen ?? shown.at(-1)) ? 0 : -1;
      mark.addEventListener("click", () => this.choose(event));
      mark.addEventListener("focus", () => this.describe(event));
      return mark;
    }));
    if (focused) this.track.querySelector<HTMLElement>(`[data-utime="${focused}"]`)?.focus();
  }

  private choose(event: MapEvent): void {
    this.chosen = event;
    this.isDrawn = false;
    this.draw();
    const position = event.position ?? this.trace.at(event.utime);
    if (position) this.onChosen(position);
  }

  private step(event: KeyboardEvent): void {
    const move = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (move === undefined) return;
    const marks = [...(this.track.children as HTMLCollectionOf<HTMLElement>)];
    marks[marks.indexOf(document.activeElement as HTMLElement) + move]?.focus();
    event.preventDefault();
    event.stopPropagation();
  }

  private describe(event: MapEvent | null): void {
    const line = byId("event-line");
    if (!event) {
      setText(line, "No events yet");
      return;
    }
    if (!line.firstElementChild) line.replaceChildren(document.createElement("time"), document.createElement("span"));
    setText(line.children[0], clock(event.utime, this.events[0].utime));
    setText(line.children[1], event.text);
  }
}

/** Minutes and seconds since the first event. */
export function clock(utime: number, first: number): string {
  const seconds = Math.max(0, Math.round((utime - first) / 1e6));
  return `${String(Math.floor(seconds / 60)).padStart(2, "0")}:${String(seconds % 60).padStart(2, "0")}`;
}
