// SPDX-License-Identifier: Apache-2.0
// Orbit camera that can follow the vehicle. World: X right, Y up, Z backward at the start.

import { PerspectiveCamera, Spherical, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const FIELD_OF_VIEW_DEG = 50;
const HOME = new Spherical(24, 0.85, 0.55);
const TOP = new Spherical(45, 0.001, 0);
const NEAREST_M = 2;
const FARTHEST_M = 320;
const FLIGHT_S = 0.6;

export class CameraRig {
  readonly camera = new PerspectiveCamera(FIELD_OF_VIEW_DEG, 1, 0.1, 1000);
  readonly controls: OrbitControls;
  private readonly vehicle = new Vector3();
  private flight: { from: Vector3; to: Vector3; done: number } | null = null;

  constructor(canvas: HTMLElement) {
    this.controls = new OrbitControls(this.camera, canvas);
    Object.assign(this.controls, {
      minDistance: NEAREST_M, maxDistance: FARTHEST_M, maxPolarAngle: 1.62, zoomSpeed: 1.2, rotateSpeed: 0.8,
      enableDamping: !matchMedia("(prefers-reduced-motion: reduce)").matches, dampingFactor: 0.18,
      screenSpacePanning: false,
    });
    this.place(HOME);
  }

  private place(offset: Spherical): void {
    this.camera.position.setFromSpherical(offset).add(this.controls.target);
    this.controls.update();
  }

  private get offset(): Spherical {
    return new Spherical().setFromVector3(this.camera.position.clone().sub(this.controls.target));
  }

  reset(): void {
    this.lookAt(this.vehicle);
    this.place(HOME);
  }

  fromAbove(): void {
    const radius = Math.max(TOP.radius, this.offset.radius);
    this.place(new Spherical(radius, TOP.phi, TOP.theta));
  }

  private lookAt(point: Vector3): void {
    const shift = point.clone().sub(this.controls.target);
    this.controls.target.add(shift);
    this.camera.position.add(shift);
  }

  /** The vehicle is here now; with `follow` the picture goes along. */
  moveVehicle(position: Vector3, follow: boolean): void {
    this.vehicle.copy(position);
    if (follow && !this.flight) this.lookAt(position);
  }

  /** Glides to another place, keeping distance and direction. */
  flyTo(point: Vector3): void {
    this.flight = { from: this.controls.target.clone(), to: point.clone(), done: 0 };
  }

  /** Returns whether the picture changed. */
  advance(seconds: number): boolean {
    const before = this.controls.target.clone();
    if (this.flight) {
      this.flight.done = Math.min(1, this.flight.done + seconds / FLIGHT_S);
      const eased = this.flight.done * this.flight.done * (3 - 2 * this.flight.done);
      this.lookAt(this.flight.from.clone().lerp(this.flight.to, eased));
      if (this.flight.done === 1) this.flight = null;
    }
    const moved = this.controls.update();
    return moved || !before.equals(this.controls.target);
  }

  turn(yaw: number, pitch: number): void {
    const offset = this.offset;
    offset.theta += yaw;
    offset.phi = Math.min(1.6, Math.max(0.001, offset.phi + pitch));
    this.place(offset);
  }

  zoom(factor: number): void {
    const offset = this.offset;
    offset.radius = Math.min(FARTHEST_M, Math.max(NEAREST_M, offset.radius * factor));
    this.place(offset);
  }

  resize(width: number, height: number): void {
    this.camera.aspect = width / Math.max(1, height);
    this.camera.updateProjectionMatrix();
  }

  /** Keeps the depth buffer's precision where the picture is. */
  fitDepth(): void {
    const distance = this.offset.radius;
    this.camera.near = Math.max(0.05, 0.01 * distance);
    this.camera.far = distance + 600;
    this.camera.updateProjectionMatrix();
  }

  get targetOffVehicle(): number {
    return Math.hypot(this.controls.target.x - this.vehicle.x, this.controls.target.z - this.vehicle.z);
  }

  /** How far from the vehicle the picture reaches [m]. */
  viewRadius(): number {
    const half = Math.tan((FIELD_OF_VIEW_DEG * Math.PI) / 360);
    return viewRadius(this.offset.radius, half, this.camera.aspect, this.targetOffVehicle);
  }
}

/** `half`: tangent of half the vertical field of view. The factor covers what a slanted look shows beyond the target. */
export function viewRadius(distance: number, half: number, aspect: number, targetOffVehicle: number): number {
  return 1.7 * distance * half * Math.max(1, aspect) + targetOffVehicle;
}
