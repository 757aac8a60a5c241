// SPDX-License-Identifier: Apache-2.0
// The two dialogs: help, and "are you sure?".

import { byId } from "../dom";
import type { Shortcut } from "../shortcuts";

const GESTURES: [string, string][] = [
  ["drag, one finger", "orbit"],
  ["right drag, two fingers", "move"],
  ["wheel, pinch", "zoom"],
  ["click a loop's knob", "its figures and clouds"],
  ["click an event", "go to where it happened"],
];

export function fillHelp(shortcuts: Shortcut[]): void {
  const rows: [string, string][] = [...shortcuts.map(({ label, text }): [string, string] => [label, text]), ...GESTURES];
  byId("help-keys").replaceChildren(...rows.map(([keys, text]) => {
    const row = document.createElement("div");
    const key = document.createElement("kbd");
    key.textContent = keys;
    row.append(text, key);
    return row;
  }));
}

export function toggleHelp(): void {
  const help = byId<HTMLDialogElement>("help");
  if (help.open) help.close();
  else help.showModal();
}

/** Resolves to true when the operator agrees. */
export function confirmed(title: string, text: string, action: string): Promise<boolean> {
  const dialog = byId<HTMLDialogElement>("confirm");
  byId("confirm-title").textContent = title;
  byId("confirm-text").textContent = text;
  byId("confirm-yes").textContent = action;
  dialog.returnValue = "no";
  dialog.showModal();
  return new Promise((resolve) => {
    dialog.addEventListener("close", () => resolve(dialog.returnValue === "yes"), { once: true });
  });
}
