// SPDX-License-Identifier: Apache-2.0
// View settings: the form at the right, its legend, and the theme.

import { byId, number, setText } from "../dom";
import { AGE_RAMP, HEIGHT_RAMP, INTENSITY_RAMP, LEVEL_COLOURS, rampColour } from "../scene/palette";
import type { ColourMode, Settings, SettingsStore, Theme, Toggle } from "../settings";

const TOGGLES: Toggle[] = ["follow", "smoothed", "eskf", "keyframes", "loops", "bands"];

export class ControlsPanel {
  private readonly form = byId<HTMLFormElement>("controls");
  private readonly cut = byId<HTMLInputElement>("cut");
  private heights: [number, number] = [0, 1];

  constructor(private readonly settings: SettingsStore) {
    this.form.addEventListener("submit", (event) => event.preventDefault());
    this.form.addEventListener("input", () => this.read());
    settings.watch((values) => this.write(values));
  }

  private field(name: string): HTMLInputElement {
    return this.form.elements.namedItem(name) as HTMLInputElement;
  }

  private read(): void {
    const change: Partial<Settings> = { colour: this.field("colour").value as ColourMode };
    for (const name of TOGGLES) change[name] = this.field(name).checked;
    change.cut = this.cut.value === this.cut.max ? null : Number(this.cut.value);
    this.settings.set(change);
  }

  private write(values: Settings): void {
    this.field("colour").value = values.colour;
    for (const name of TOGGLES) this.field(name).checked = values[name];
    this.cut.value = values.cut === null ? this.cut.max : String(values.cut);
    setText(byId("cut-text"), values.cut === null ? "off" : number(values.cut, 2, " m"));
    this.drawLegend(values);
  }

  /** By how much the cut moves, in steps of the slider. */
  stepCut(steps: number): void {
    const top = Number(this.cut.max), step = Number(this.cut.step);
    const next = Math.max(0, (this.settings.values.cut ?? top) + steps * step);
    this.settings.set({ cut: next >= top ? null : next });
  }

  setHeights(heights: [number, number]): void {
    if (this.heights[0] === heights[0] && this.heights[1] === heights[1]) return;
    this.heights = heights;
    this.drawLegend(this.settings.values);
  }

  private drawLegend({ colour }: Settings): void {
    const [low, high] = legendEnds(colour, this.heights);
    setText(byId("legend-low"), low);
    setText(byId("legend-high"), high);
    const canvas = byId<HTMLCanvasElement>("legend-ramp");
    const context = canvas.getContext("2d")!;
    for (let x = 0; x < canvas.width; x++) {
      const t = x / (canvas.width - 1);
      const shown = colour === "level" ? LEVEL_COLOURS[Math.min(2, Math.floor(3 * t))] : rampColour(RAMPS[colour], t);
      context.fillStyle = `rgb(${shown.map((value) => Math.round(255 * value)).join(" ")})`;
      context.fillRect(x, 0, 1, 1);
    }
  }
}

const RAMPS = { height: HEIGHT_RAMP, intensity: INTENSITY_RAMP, age: AGE_RAMP };

function legendEnds(colour: ColourMode, [low, high]: [number, number]): [string, string] {
  if (colour === "height") return [number(low, 1, " m"), number(high, 1, " m")];
  if (colour === "intensity") return ["dark", "bright"];
  return colour === "level" ? ["fine", "coarse"] : ["now", "10 min"];
}

/** The chosen theme, or the system's; calls back now and whenever it becomes another one. */
export function watchTheme(settings: SettingsStore, apply: (theme: Theme) => void): () => void {
  const system = matchMedia("(prefers-color-scheme: light)");
  const current = (): Theme => settings.values.theme ?? (system.matches ? "light" : "dark");
  let shown: Theme | null = null;
  const update = (): void => {
    if (shown === current()) return;
    shown = current();
    document.documentElement.dataset.theme = shown;
    apply(shown);
  };
  system.addEventListener("change", update);
  settings.watch(update);
  return () => settings.set({ theme: current() === "dark" ? "light" : "dark" });
}
