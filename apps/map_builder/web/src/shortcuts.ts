// SPDX-License-Identifier: Apache-2.0
// Keys. They act on the whole page, except while the operator types or a dialog is open.

export interface Shortcut {
  /** Values of KeyboardEvent.key. */
  keys: string[];
  label: string;
  text: string;
  act: (key: string) => void;
}

export function listen(shortcuts: Shortcut[]): void {
  const actions = new Map(shortcuts.flatMap(({ keys, act }) => keys.map((key) => [key, act])));
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (isTakenBy(document.activeElement, key)) return;
    const act = actions.get(key);
    if (!act) return;
    event.preventDefault();
    act(key);
  });
}

/** Arrow keys belong to a focused slider or choice. */
function isTakenBy(element: Element | null, key: string): boolean {
  const isInput = element instanceof HTMLInputElement && element.type !== "checkbox";
  return isInput && (key.startsWith("Arrow") || key === "Home" || key === "End");
}
