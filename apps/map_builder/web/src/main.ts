// SPDX-License-Identifier: Apache-2.0
// The GLOBMAP view: wires the worker's stream to the picture and to the panels.

import "./fonts.css";
import "./view.css";
import { byId } from "./dom";
import { KEPT_APPLIED, makeHook } from "./page_hook";
import { ControlsPanel, watchTheme } from "./panels/controls";
import { fillHelp, toggleHelp } from "./panels/dialogs";
import { HudPanel } from "./panels/hud";
import { LoopPanel } from "./panels/loop_panel";
import { StatusDisplay } from "./panels/status";
import { Timeline } from "./panels/timeline";
import { MapView } from "./scene/map_view";
import { COLOUR_MODES, SettingsStore } from "./settings";
import { type Shortcut, listen } from "./shortcuts";
import type { ClientText, Hello, ServerText } from "./stream/protocol";
import type { FromWorker, ToWorker } from "./stream/worker_messages";
import { ViewReporter } from "./view_reporter";

const STATUS_PERIOD_MS = 200;
const NARROW = "(max-width: 760px), (max-height: 520px)";

const worker = new Worker(new URL("./stream/worker.ts", import.meta.url), { type: "module", name: "stream" });
const post = (message: ToWorker): void => worker.postMessage(message);
const send = (message: ClientText): void => post({ kind: "send", message });

const settings = new SettingsStore();
const view = openView();
const hud = new HudPanel();
const status = new StatusDisplay();
const timeline = new Timeline();
const loops = new LoopPanel(send);
const controls = new ControlsPanel(settings);
const hook = makeHook({ audit: () => view.voxels.audit(), knobs: () => view.knobs() });
const reporter = new ViewReporter((radius) => send({ view: radius }));
const switchTheme = watchTheme(settings, (theme) => view.setTheme(theme));
let hello: Hello | null = null;
let isContentWaiting = false;

settings.watch((values) => view.setSettings(values));
loops.onChosen = (loop) => view.selectLoop(loop);
loops.onGoTo = ({ from }) => {
  const position = view.keyframes.position(from);
  if (position) goTo(position);
};
view.onArcPicked = (arc) => loops.choose(arc && { from: arc.fromId, to: arc.toId });
timeline.onChosen = goTo;

function openView(): MapView {
  try {
    return new MapView(byId<HTMLCanvasElement>("map"));
  } catch (error) {
    byId("banner").hidden = false;
    byId("banner-title").textContent = "No picture";
    byId("banner-text").textContent = "This browser offers no WebGL 2, or it is switched off";
    throw error;
  }
}

function goTo(position: [number, number, number]): void {
  settings.set({ follow: false });
  view.flyTo(position);
}

// --- stream -----------------------------------------------------------------------------------------------------------

worker.onmessage = ({ data }: MessageEvent<FromWorker>) => {
  if (data.kind === "waiting") isContentWaiting = true;
  else if (data.kind === "text") takeAnyText(data.message);
  else if (data.kind === "content") takeContent(data);
  else if (data.kind === "clouds") {
    if (!loops.isChosen(data.announcement.from, data.announcement.to)) return;
    view.clouds.set(data.from, data.to);
    view.redraw();
    hook.loopClouds = [...view.clouds.counts];
    loops.showPoints(hook.loopClouds[0], hook.loopClouds[1]);
  } else if (data.kind === "opened") {
    hook.connected = true;
    hook.connections++;
    reporter.forget();
    timeline.clear();
    status.opened();
  } else {
    hook.connected = false;
    status.closed(data.attempt, data.retryMs);
  }
};

/** A text that is not what the server should send must not end the page: the next one is a tenth of a second away. */
function takeAnyText(message: ServerText): void {
  try {
    takeText(message);
  } catch (error) {
    if (!(error instanceof TypeError || error instanceof RangeError)) throw error;
    hook.refusedTexts++;
  }
}

function takeText(message: ServerText): void {
  switch (message.type) {
    case "hello":
      hello = message;
      view.setHello(message);
      break;
    case "hud":
      hook.hud = message;
      hud.show(message);
      status.setPoseAge(message.state?.age_s ?? null);
      status.setHealth(message.health ?? []);
      if (message.state) {
        view.setPose(message.state);
        timeline.trace.add(message.state.utime, message.state.position);
        timeline.setNow(message.state.utime);
      }
      break;
    case "loops":
      hook.loops = message.list.map(({ from, to, stage }) => ({ from, to, stage }));
      view.setLoops(message.list);
      loops.set(message.list);
      break;
    case "keyframes":
      view.applyKeyframes(message);
      hook.keyframes = view.keyframes.count;
      break;
    case "event":
      timeline.add(message);
      hook.events = timeline.count;
      break;
    case "view":
      hook.servedRadius = message.radius;
      break;
    case "command":
      loops.showAnswer(message.sent ? `${message.command} sent to the back end` : `${message.command} could not be sent`);
      break;
    case "error":
      loops.showAnswer(message.reason);
      break;
  }
}

function takeContent(content: Extract<FromWorker, { kind: "content" }>): void {
  view.applyChunks(content.chunks, content.tick, content.heights);
  view.setPaths(content.odometryPath, content.smoothedPath);
  if (content.loopEdges) view.setEdges(content.loopEdges);
  controls.setHeights(content.heights);
  Object.assign(hook, content.counts);
  if (content.odometryPath) hook.paths.eskf = content.odometryPath.length / 3;
  if (content.smoothedPath) hook.paths.smoothed = content.smoothedPath.length / 3;
  const newest = content.applied.at(-1);
  if (!newest) return;
  const { sequence, revision, checksum, counts } = newest;
  Object.assign(hook, { sequence, revision, checksum, counts, lastFrameAt: performance.now() });
  hook.applied = [...hook.applied, ...content.applied].slice(-KEPT_APPLIED);
  hud.showMap(revision, counts, checksum === newest.announcedChecksum);
}

view.onFrame = (now) => {
  if (isContentWaiting) {
    isContentWaiting = false;
    post({ kind: "take" });
  }
  if (hook.connected && hello) hook.viewRadius = reporter.update(view.rig.viewRadius(), hello.max_view_m, now);
  hook.drawn = view.drawn;
  hook.vehicle = view.vehicle.position.toArray();
  hook.cameraTarget = view.rig.controls.target.toArray();
};

setInterval(() => {
  status.show();
  hud.showAge(status.dataAgeS);
  timeline.draw();
}, STATUS_PERIOD_MS);

// --- operator ---------------------------------------------------------------------------------------------------------

/** On a narrow screen one panel at a time. */
function openAlone(opened: "hud" | "controls" | "loops"): void {
  if (!matchMedia(NARROW).matches) return;
  if (opened !== "hud") setFigures(false);
  if (opened !== "controls") setControls(false);
  if (opened !== "loops") loops.setOpen(false);
}

function setControls(isOpen: boolean): void {
  byId("controls").hidden = !isOpen;
  byId("toggle-controls").setAttribute("aria-expanded", String(isOpen));
  if (isOpen) openAlone("controls");
}

function setFigures(isOpen: boolean): void {
  document.body.classList.toggle("with-hud", isOpen);
  byId("toggle-hud").setAttribute("aria-expanded", String(isOpen));
  if (isOpen) openAlone("hud");
}

const toggleControls = (): void => setControls(!!byId("controls").hidden);
const toggleFigures = (): void => setFigures(!document.body.classList.contains("with-hud"));
loops.onOpened = () => openAlone("loops");

const orbit = (yaw: number, pitch: number) => () => view.rig.turn(yaw, pitch);
const shortcuts: Shortcut[] = [
  { keys: ["f"], label: "F", text: "follow the vehicle", act: () => settings.toggle("follow") },
  { keys: ["r"], label: "R", text: "reset the view", act: () => resetView() },
  { keys: ["t"], label: "T", text: "look from above", act: () => view.rig.fromAbove() },
  { keys: ["ArrowLeft"], label: "← →", text: "turn", act: orbit(-0.1, 0) },
  { keys: ["ArrowRight"], label: "← →", text: "", act: orbit(0.1, 0) },
  { keys: ["ArrowUp"], label: "↑ ↓", text: "tilt", act: orbit(0, -0.1) },
  { keys: ["ArrowDown"], label: "↑ ↓", text: "", act: orbit(0, 0.1) },
  { keys: ["+", "="], label: "+ −", text: "zoom", act: () => view.rig.zoom(0.87) },
  { keys: ["-"], label: "+ −", text: "", act: () => view.rig.zoom(1.15) },
  { keys: ["1", "2", "3", "4"], label: "1 – 4", text: "colour by height, intensity, level, age",
    act: (key) => settings.set({ colour: COLOUR_MODES[Number(key) - 1] }) },
  { keys: ["["], label: "[ ]", text: "cut lower, higher", act: () => controls.stepCut(-1) },
  { keys: ["]"], label: "[ ]", text: "", act: () => controls.stepCut(1) },
  { keys: ["s"], label: "S", text: "smoothed path", act: () => settings.toggle("smoothed") },
  { keys: ["e"], label: "E", text: "ESKF-only path", act: () => settings.toggle("eskf") },
  { keys: ["k"], label: "K", text: "keyframes", act: () => settings.toggle("keyframes") },
  { keys: ["o"], label: "O", text: "loop arcs", act: () => settings.toggle("loops") },
  { keys: ["b"], label: "B", text: "bands", act: () => settings.toggle("bands") },
  { keys: ["l"], label: "L", text: "list of loops", act: () => loops.setOpen(!loops.isOpen) },
  { keys: ["v"], label: "V", text: "view settings", act: toggleControls },
  { keys: ["h"], label: "H", text: "hide everything but the map", act: () => document.body.classList.toggle("bare") },
  { keys: ["d"], label: "D", text: "dark or light", act: switchTheme },
  { keys: ["?"], label: "?", text: "this help", act: toggleHelp },
];
listen(shortcuts);
fillHelp(shortcuts.filter(({ text }) => text !== ""));

function resetView(): void {
  settings.set({ follow: true });
  view.rig.reset();
}

byId("reset").addEventListener("click", resetView);
byId("from-above").addEventListener("click", () => view.rig.fromAbove());
byId("theme").addEventListener("click", switchTheme);
byId("open-help").addEventListener("click", toggleHelp);
byId("toggle-controls").addEventListener("click", toggleControls);
byId("toggle-hud").addEventListener("click", toggleFigures);
if (matchMedia(NARROW).matches) setControls(false);
document.addEventListener("visibilitychange", () => {
  if (!document.hidden) post({ kind: "retry" });
});

post({ kind: "open", url: `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws/lio_map` });
