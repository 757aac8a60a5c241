// SPDX-License-Identifier: Apache-2.0
// Fills the head-up display from the server's text messages.

const element = (id) => document.getElementById(id);
const number = (value, digits, unit) => (Number.isFinite(value) ? `${value.toFixed(digits)} ${unit}` : "–");

function set(id, text, quality = "") {
  const node = element(id);
  if (node.textContent !== text) node.textContent = text;
  node.className = quality;
}

export function showHud({ state, scan, loop, map }) {
  if (state) {
    for (const name of ["yaw", "pitch", "roll"]) set(name, number(state[`${name}_deg`], 1, "°"));
    for (const name of ["right", "up", "forward"]) set(name, number(state[`${name}_mps`], 2, "m/s"));
  }
  if (scan) {
    set("scan", scan.applied ? "applied" : scan.reason || "not applied", scan.applied ? "good" : "bad");
    set("matched", `${scan.matched} of ${scan.points}`);
    set("applied", `${scan.total_applied}, ${scan.total_rejected} not`);
  }
  if (loop) {
    const text = loop.accepted ? `closed, ${number(loop.correction_m, 2, "m")}` : loop.reason || "no candidate";
    set("loop", text, loop.accepted ? "good" : "");
    set("loops", `${loop.total_accepted}` + (loop.total_withdrawn ? `, ${loop.total_withdrawn} withdrawn` : ""));
  }
  set("keyframes", `${map.keyframes}`);
  set("revision", `${map.revision}` + (map.rebuilding ? ", rebuilding" : `, ${map.rebuilds} rebuilds`));
  map.voxels.forEach((count, i) => set(`voxels${i}`, count.toLocaleString("en")));
  set("memory", number(map.bytes / 1e6, 1, "MB"));
  set("lost", `${map.messages_lost}`, map.messages_lost ? "bad" : "good");
  if (map.health) set("health", map.health, map.health === "OK" ? "good" : "bad");
}

/** kind: live, stale or lost. */
export function showConnection(kind, text) {
  const node = element("connection");
  if (node.textContent !== text) node.textContent = text;
  node.className = kind;
}
