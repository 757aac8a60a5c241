// SPDX-License-Identifier: Apache-2.0
// What the operator has chosen, kept across visits where the browser allows it.

export const COLOUR_MODES = ["height", "intensity", "level", "age"] as const;
export type ColourMode = (typeof COLOUR_MODES)[number];
export type Theme = "dark" | "light";

export interface Settings {
  colour: ColourMode;
  /** Voxels higher than so many metres above the vehicle are hidden; null hides none. */
  cut: number | null;
  follow: boolean;
  smoothed: boolean;
  eskf: boolean;
  keyframes: boolean;
  loops: boolean;
  bands: boolean;
  /** null: as the system says. */
  theme: Theme | null;
}

export type Toggle = "follow" | "smoothed" | "eskf" | "keyframes" | "loops" | "bands";
const KEY = "ignis.view";

export const DEFAULTS: Settings = {
  colour: "height", cut: 2.5, follow: true, smoothed: true, eskf: true, keyframes: true, loops: true, bands: true,
  theme: null,
};

export class SettingsStore {
  readonly values: Settings;
  private readonly listeners: ((values: Settings) => void)[] = [];

  constructor() {
    this.values = { ...DEFAULTS, ...read() };
  }

  /** Calls back now and after each change. */
  watch(listener: (values: Settings) => void): void {
    this.listeners.push(listener);
    listener(this.values);
  }

  set(change: Partial<Settings>): void {
    Object.assign(this.values, change);
    try {
      localStorage.setItem(KEY, JSON.stringify(this.values));
    } catch {
      // Storage may be off; then the choice lasts as long as the page.
    }
    for (const listener of this.listeners) listener(this.values);
  }

  toggle(name: Toggle): void {
    this.set({ [name]: !this.values[name] });
  }
}

function read(): Partial<Settings> {
  try {
    const stored: unknown = JSON.parse(localStorage.getItem(KEY) ?? "{}");
    return sane(typeof stored === "object" && stored !== null ? (stored as Record<string, unknown>) : {});
  } catch {
    return {};
  }
}

/** Takes only what this version can use: another one may have written it. */
export function sane(stored: Record<string, unknown>): Partial<Settings> {
  const result: Record<string, unknown> = {};
  for (const [name, value] of Object.entries(DEFAULTS)) {
    if (typeof value === "boolean" && typeof stored[name] === "boolean") result[name] = stored[name];
  }
  if (COLOUR_MODES.includes(stored.colour as ColourMode)) result.colour = stored.colour;
  if (stored.theme === "dark" || stored.theme === "light") result.theme = stored.theme;
  if (stored.cut === null || Number.isFinite(stored.cut)) result.cut = stored.cut;
  return result as Partial<Settings>;
}
