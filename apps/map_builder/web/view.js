// SPDX-License-Identifier: Apache-2.0
// The GLOBMAP view: one WebSocket in, one picture out. A frame is decoded when the browser draws, newest only, so a
// hidden tab collects nothing.

import { PROTOCOL, decodeFrame, rotate } from "./decode.js";
import { OrbitCamera } from "./camera.js";
import { Scene } from "./scene.js";
import { showConnection, showHud } from "./hud.js";

const STALE_AFTER_S = 2;
const VIEW_REPORT_MS = 250;
const LINES = {
  smoothed: { strip: true, colour: [0.32, 0.88, 0.49], width: 3 },
  eskf: { strip: true, colour: [1.0, 0.54, 0.24], width: 2 },
  loops: { strip: false, colour: [1.0, 0.31, 0.82], width: 2 },
  bands: { strip: false, colour: [0.22, 0.29, 0.36], width: 1 },
  vehicle: { strip: false, colour: [1.0, 1.0, 1.0], width: 2.5 },
};

// For tests and for the curious: what has arrived and what is shown.
const counters = window.ignisView = {
  connected: false, stale: false, connections: 0, frames: 0, huds: 0, errors: 0, drawn: 0, bytes: 0, revision: -1,
  voxels: [0, 0, 0], paths: { eskf: 0, smoothed: 0 }, loops: 0, viewRadius: 0, served: 0, position: [0, 0, 0], hud: null,
};

const input = (id) => document.getElementById(id);
const canvas = input("map");
let dirty = true, socket = null, pendingFrame = null, reportedRadius = 0, lastReport = 0, retryMs = 500;
let heights = { low: -2, high: 3 }, bandRadii = [], pose = null;

const camera = new OrbitCamera(canvas, () => { dirty = true; });
const scene = new Scene(canvas);

function circle(centre, radius) {
  const points = [], steps = 96;
  for (let i = 0; i < steps; i++) {
    for (const k of [i, i + 1]) {
      const angle = 2 * Math.PI * k / steps;
      points.push(centre[0] + radius * Math.cos(angle), centre[1], centre[2] + radius * Math.sin(angle));
    }
  }
  return points;
}

/** An arrow with a short mast, pointing forward (-Z of the body). */
function vehicleLines({ position, quaternion }) {
  const corners = [[0, 0, -0.9], [0.4, 0, 0.5], [0, 0, 0.25], [-0.4, 0, 0.5], [0, 0, 0], [0, 0.6, 0]]
    .map((corner) => rotate(quaternion, corner).map((value, i) => value + position[i]));
  return [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5]].flatMap(([a, b]) => [...corners[a], ...corners[b]]);
}

function takeFrame(buffer) {
  const frame = decodeFrame(buffer);
  pose = frame.pose;
  camera.moveVehicle(pose.position, input("follow").checked);
  scene.setLevels(frame.levels);
  scene.setLine("bands", new Float32Array(bandRadii.flatMap((radius) => circle(pose.position, radius))), LINES.bands);
  scene.setLine("eskf", frame.eskfPath, LINES.eskf);
  scene.setLine("smoothed", frame.smoothedPath, LINES.smoothed);
  scene.setLine("loops", frame.loopEdges, LINES.loops);
  scene.setLine("vehicle", new Float32Array(vehicleLines(pose)), LINES.vehicle);
  const shown = frame.levels.filter((level) => level.count > 0);
  if (shown.length > 0) {
    heights = { low: Math.min(...shown.map((level) => level.min)), high: Math.max(...shown.map((level) => level.max)) };
  }
  counters.frames++;
  counters.bytes += buffer.byteLength;
  counters.voxels = frame.levels.map((level) => level.count);
  counters.paths = { eskf: frame.eskfPath.length / 3, smoothed: frame.smoothedPath.length / 3 };
  counters.loops = frame.loopEdges.length / 6;
  counters.position = pose.position;
}

function takeText(text) {
  const message = JSON.parse(text);
  if (message.type === "hud") {
    counters.huds++;
    counters.hud = message;
    counters.revision = message.map.revision;
    bandRadii = message.map.bands_m;
    showHud(message);
    const age = message.state ? message.state.age_s : Infinity;
    counters.stale = !(age < STALE_AFTER_S);
    if (!counters.stale) showConnection("live", "live");
    else showConnection("stale", message.state ? `no data for ${age.toFixed(0)} s` : "waiting for data");
  } else if (message.type === "view") {
    counters.served = message.radius;
  } else if (message.type === "error") {
    counters.errors++;
    console.warn("map_builder refused a request:", message.reason);
  }
}

function connect() {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws/lio_map`, PROTOCOL);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => {
    counters.connected = true;
    counters.connections++;
    retryMs = 500;
    reportedRadius = 0;
    showConnection("live", "connected");
  };
  socket.onmessage = ({ data }) => {
    if (typeof data === "string") takeText(data);
    else pendingFrame = data;
  };
  socket.onclose = () => {
    counters.connected = false;
    counters.stale = true;
    showConnection("lost", "disconnected, trying again");
    setTimeout(connect, retryMs);
    retryMs = Math.min(5000, 2 * retryMs);
  };
}

function reportView(now) {
  const radius = Math.min(1000, Math.max(1, camera.viewRadius()));
  counters.viewRadius = radius;
  const changed = Math.abs(radius - reportedRadius) > 0.05 * reportedRadius;
  if (!changed || now - lastReport < VIEW_REPORT_MS || socket?.readyState !== WebSocket.OPEN) return;
  socket.send(JSON.stringify({ view: Math.round(10 * radius) / 10 }));
  reportedRadius = radius;
  lastReport = now;
}

function draw(now) {
  requestAnimationFrame(draw);
  reportView(now);
  if (pendingFrame) {
    const frame = pendingFrame;
    pendingFrame = null;
    try {
      takeFrame(frame);
      dirty = true;
    } catch (error) {
      counters.errors++;
      console.error(error);
    }
  }
  if (!dirty) return;
  dirty = false;
  for (const [box, line] of [["show-smoothed", "smoothed"], ["show-eskf", "eskf"], ["show-loops", "loops"],
    ["show-bands", "bands"]]) {
    if (scene.lines.has(line)) scene.lines.get(line).visible = input(box).checked;
  }
  const cut = Number(input("cut").value), isCut = cut < Number(input("cut").max);
  const cutHeight = isCut ? (pose ? pose.position[1] : 0) + cut : Infinity;
  scene.draw(camera, {
    colourMode: Number(input("colour").value), cutHeight: isCut ? cutHeight : 1e9,
    low: heights.low, high: Math.min(heights.high, cutHeight),
  });
  counters.drawn++;
}

for (const id of ["colour", "cut", "show-smoothed", "show-eskf", "show-loops", "show-bands", "follow"]) {
  input(id).addEventListener("input", () => {
    const cut = input("cut");
    input("cut-text").textContent = cut.value === cut.max ? "off" : `${cut.value} m`;
    dirty = true;
  });
}
input("controls").addEventListener("submit", (event) => event.preventDefault());
input("reset").addEventListener("click", () => camera.reset());
window.addEventListener("resize", () => { dirty = true; });
connect();
requestAnimationFrame(draw);
