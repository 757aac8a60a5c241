// SPDX-License-Identifier: Apache-2.0
// The picture: owns the renderer, draws when something has changed, and only then.

import { Scene, Vector3 as ThreeVector, WebGLRenderer } from "three";
import type { Settings, Theme } from "../settings";
import type { Hello, HudState, Keyframes, Loop, PerLevel, Vector3 } from "../stream/protocol";
import type { LoopEdge } from "../stream/frame";
import type { ChunkUpdate } from "../stream/voxel_store";
import { CameraRig } from "./camera_rig";
import { KeyframeMarkers } from "./keyframe_markers";
import { type Arc, LoopArcs } from "./loop_arcs";
import { LoopCloudPoints } from "./loop_clouds";
import { SCENE_COLOURS, rgb } from "./palette";
import { PathLine } from "./path_line";
import { VehicleGlyph } from "./vehicle";
import { VoxelChunks } from "./voxel_chunks";
import { setColourMode, sharedUniforms } from "./voxel_material";

const MAX_PIXEL_RATIO = 2;
const LONGEST_STEP_S = 0.1;

export class MapView {
  readonly rig: CameraRig;
  readonly vehicle = new VehicleGlyph();
  readonly keyframes = new KeyframeMarkers();
  readonly clouds = new LoopCloudPoints();
  readonly uniforms = sharedUniforms();
  readonly voxels = new VoxelChunks(this.uniforms);
  /** Called before each animation frame with its time [ms]; draws nothing itself. */
  onFrame: (now: number) => void = () => {};
  onArcPicked: (arc: Arc | null) => void = () => {};
  drawn = 0;
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly smoothedPath = new PathLine(3.5);
  private readonly eskfPath = new PathLine(2);
  private readonly arcs = new LoopArcs();
  private edges: LoopEdge[] = [];
  private loops: Loop[] = [];
  private selected: { from: number; to: number } | null = null;
  private heights: [number, number] = [0, 1];
  private settings: Settings | null = null;
  private dirty = true;
  private lastFrame = 0;

  constructor(private readonly canvas: HTMLCanvasElement) {
    // Dense screens show no stairs.
    this.renderer = new WebGLRenderer({ canvas, antialias: devicePixelRatio < 2, powerPreference: "high-performance" });
    this.rig = new CameraRig(canvas);
    this.scene.add(this.voxels.group, this.eskfPath.group, this.smoothedPath.group, this.keyframes.discs.points,
      this.arcs.group, this.clouds.group, this.vehicle.group);
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
    this.watchPicks();
    canvas.addEventListener("webglcontextrestored", () => this.redraw());
    requestAnimationFrame((now) => this.frame(now));
  }

  redraw(): void {
    this.dirty = true;
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const ratio = Math.min(MAX_PIXEL_RATIO, devicePixelRatio);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.rig.resize(width, height);
    this.keyframes.discs.setPixelRatio(ratio);
    this.arcs.setPixelRatio(ratio);
    this.dirty = true;
  }

  private frame(now: number): void {
    requestAnimationFrame((next) => this.frame(next));
    const seconds = Math.min(LONGEST_STEP_S, (now - this.lastFrame) / 1000);
    this.lastFrame = now;
    this.onFrame(now);
    const vehicleMoved = this.vehicle.advance(seconds);
    if (vehicleMoved) this.rig.moveVehicle(this.vehicle.position, this.settings?.follow ?? true);
    const cameraMoved = this.rig.advance(seconds);
    if (!vehicleMoved && !cameraMoved && !this.dirty) return;
    this.dirty = false;
    this.updateUniforms();
    this.rig.fitDepth();
    this.renderer.render(this.scene, this.rig.camera);
    this.drawn++;
  }

  private updateUniforms(): void {
    const { uniforms, vehicle, rig } = this;
    const cut = this.settings?.cut ?? null;
    const ceiling = cut === null ? Infinity : vehicle.position.y + cut;
    uniforms.u_cut.value = Math.min(ceiling, 1e9);
    [uniforms.u_low.value] = this.heights;
    uniforms.u_high.value = Math.min(this.heights[1], ceiling);
    uniforms.u_veil.value = this.clouds.group.visible ? 1 : 0;
    uniforms.u_centre.value.copy(vehicle.position);
    const reach = rig.viewRadius();
    uniforms.u_fade_from.value = 0.75 * reach;
    uniforms.u_fade_to.value = 1.3 * reach;
    const height = this.canvas.clientHeight * Math.min(MAX_PIXEL_RATIO, devicePixelRatio);
    uniforms.u_pixels_per_radian.value = height / ((rig.camera.fov * Math.PI) / 180);
  }

  // --- content -------------------------------------------------------------------------------------------------------

  setHello(hello: Hello): void {
    this.vehicle.setRings(hello.window_m as PerLevel);
    this.keyframes.clear();
    this.dirty = true;
  }

  applyChunks(chunks: ChunkUpdate[], tick: number, heights: [number, number]): void {
    this.voxels.apply(chunks);
    this.uniforms.u_tick.value = tick;
    this.heights = heights;
    this.dirty = true;
  }

  setPaths(eskf: Float32Array | null, smoothed: Float32Array | null): void {
    if (eskf) this.eskfPath.setPoints(eskf);
    if (smoothed) this.smoothedPath.setPoints(smoothed);
    this.dirty = true;
  }

  setPose(state: HudState): void {
    this.vehicle.moveTo(state.position, state.quaternion);
  }

  applyKeyframes(message: Keyframes): void {
    this.keyframes.apply(message);
    this.drawArcs();
  }

  setEdges(edges: LoopEdge[]): void {
    this.edges = edges;
    this.drawArcs();
  }

  setLoops(loops: Loop[]): void {
    this.loops = loops;
    this.drawArcs();
  }

  selectLoop(loop: { from: number; to: number } | null): void {
    this.selected = loop;
    this.arcs.select(loop?.from ?? null, loop?.to ?? null);
    if (!loop) this.clouds.clear();
    this.drawArcs();
  }

  /** Loops, placed by the edges of the frame or else by their keyframes. Refused candidates only while chosen. */
  private drawArcs(): void {
    const arcs = new Map<string, Arc>();
    for (const edge of this.edges) arcs.set(`${edge.fromId}-${edge.toId}`, { ...edge, stage: "kept" });
    for (const { from, to, stage } of this.loops) {
      const isChosen = from === this.selected?.from && to === this.selected.to;
      if (stage === "candidate" && !isChosen) continue;
      const known = arcs.get(`${from}-${to}`);
      const ends = known ? [known.from, known.to] : [this.keyframes.position(from), this.keyframes.position(to)];
      if (ends[0] && ends[1]) {
        arcs.set(`${from}-${to}`, { fromId: from, toId: to, from: ends[0], to: ends[1], stage });
      }
    }
    this.arcs.set([...arcs.values()]);
    this.dirty = true;
  }

  flyTo(point: Vector3): void {
    this.rig.flyTo(new ThreeVector(...point));
    this.dirty = true;
  }

  // --- look ----------------------------------------------------------------------------------------------------------

  setSettings(settings: Settings): void {
    this.settings = settings;
    setColourMode(this.uniforms, settings.colour);
    this.smoothedPath.group.visible = settings.smoothed;
    this.eskfPath.group.visible = settings.eskf;
    this.keyframes.discs.points.visible = settings.keyframes;
    this.arcs.group.visible = settings.loops;
    this.vehicle.rings.visible = settings.bands;
    this.rig.moveVehicle(this.vehicle.position, settings.follow);
    this.dirty = true;
  }

  setTheme(theme: Theme): void {
    const colours = SCENE_COLOURS[theme];
    const background = rgb(colours.background);
    this.renderer.setClearColor(colours.background);
    this.uniforms.u_background.value.set(...background);
    this.uniforms.u_edge.value = colours.edge;
    this.uniforms.u_lift.value = colours.lift;
    this.smoothedPath.setColour(colours.smoothed);
    this.eskfPath.setColour(colours.eskf);
    this.keyframes.setColour(rgb(colours.keyframe), background);
    this.arcs.setTheme(background);
    this.vehicle.setColours(colours.vehicle, colours.band);
    this.clouds.setColours(colours.cloudFrom, colours.cloudTo);
    this.dirty = true;
  }

  /** Where each loop can be clicked in the window. */
  knobs(): { from: number; to: number; x: number; y: number }[] {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    return this.arcs
      .knobsOn(width, height, this.rig.camera)
      .map(({ arc, x, y }) => ({ from: arc.fromId, to: arc.toId, x: x + left, y: y + top }));
  }

  /** A click or tap that is no drag picks a loop. */
  private watchPicks(): void {
    let pressed: { x: number; y: number } | null = null;
    this.canvas.addEventListener("pointerdown", ({ clientX, clientY }) => (pressed = { x: clientX, y: clientY }));
    this.canvas.addEventListener("pointerup", (event) => {
      if (!pressed || Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) > 5) return;
      pressed = null;
      if (!this.settings?.loops) return;
      const { left, top, width, height } = this.canvas.getBoundingClientRect();
      const reach = event.pointerType === "touch" ? 28 : 16;
      const { camera } = this.rig;
      this.onArcPicked(this.arcs.pick(event.clientX - left, event.clientY - top, width, height, camera, reach));
    });
  }
}
