// SPDX-License-Identifier: Apache-2.0
// Orbit camera around a target. World: X right, Y up, Z backward. All pictures are drawn relative to the target.

const FIELD_OF_VIEW = 0.9; // rad, vertical
const DEFAULTS = { yaw: 0.5, pitch: 0.75, distance: 22 };

export class OrbitCamera {
  constructor(canvas, onChange) {
    this.canvas = canvas;
    this.onChange = onChange;
    this.vehicle = [0, 0, 0];
    this.pointers = new Map();
    this.reset();
    canvas.addEventListener("pointerdown", (event) => this.press(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) => this.pointers.delete(event.pointerId));
    }
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(0.0012 * event.deltaY));
    }, { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  reset() {
    Object.assign(this, DEFAULTS);
    this.target = [...this.vehicle];
    this.onChange();
  }

  /** The vehicle moved; the target goes along when `follow` is set. */
  moveVehicle(position, follow) {
    if (follow) this.target = this.target.map((value, i) => value + position[i] - this.vehicle[i]);
    this.vehicle = [...position];
  }

  press(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  }

  move(event) {
    const last = this.pointers.get(event.pointerId);
    if (!last) return;
    const dx = event.clientX - last.x, dy = event.clientY - last.y;
    if (this.pointers.size === 2) {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1];
      const before = Math.hypot(last.x - other.x, last.y - other.y);
      const after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
      if (before > 0 && after > 0) this.zoom(before / after);
      this.pan(dx / 2, dy / 2);
    } else if (event.buttons & 2 || event.shiftKey) {
      this.pan(dx, dy);
    } else {
      this.turn(-0.006 * dx, 0.006 * dy);
    }
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  }

  key(event) {
    const actions = {
      ArrowLeft: () => this.turn(-0.1, 0), ArrowRight: () => this.turn(0.1, 0),
      ArrowUp: () => this.turn(0, 0.1), ArrowDown: () => this.turn(0, -0.1),
      "+": () => this.zoom(0.87), "-": () => this.zoom(1.15),
    };
    if (!actions[event.key]) return;
    event.preventDefault();
    actions[event.key]();
  }

  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.min(1.55, Math.max(-0.3, this.pitch + pitch));
    this.onChange();
  }

  zoom(factor) {
    this.distance = Math.min(300, Math.max(2, this.distance * factor));
    this.onChange();
  }

  pan(dx, dy) {
    const metresPerPixel = 2 * this.distance * Math.tan(FIELD_OF_VIEW / 2) / this.canvas.clientHeight;
    const cos = Math.cos(this.yaw), sin = Math.sin(this.yaw);
    const right = -dx * metresPerPixel, back = -dy * metresPerPixel;
    this.target[0] += cos * right + sin * back;
    this.target[2] += -sin * right + cos * back;
    this.onChange();
  }

  /** Eye relative to the target. */
  eye() {
    const flat = Math.cos(this.pitch) * this.distance;
    return [Math.sin(this.yaw) * flat, Math.sin(this.pitch) * this.distance, Math.cos(this.yaw) * flat];
  }

  /** How far from the vehicle the picture reaches [m]. */
  viewRadius() {
    const aspect = this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight);
    const reach = 1.6 * this.distance * Math.tan(FIELD_OF_VIEW / 2) * Math.max(1, aspect);
    return reach + Math.hypot(this.target[0] - this.vehicle[0], this.target[2] - this.vehicle[2]);
  }

  /** Column-major projection times view, for points relative to the target. */
  matrix() {
    const aspect = this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight);
    const near = 0.02 * this.distance, far = this.distance + 400;
    const f = 1 / Math.tan(FIELD_OF_VIEW / 2);
    const [sy, cy, sp, cp] = [Math.sin(this.yaw), Math.cos(this.yaw), Math.sin(this.pitch), Math.cos(this.pitch)];
    // Rows of the view rotation: right, up, backward.
    const r = [cy, 0, -sy], u = [-sp * sy, cp, -sp * cy], b = [cp * sy, sp, cp * cy];
    const a = (far + near) / (near - far), c = 2 * far * near / (near - far);
    const columns = [];
    for (let i = 0; i < 3; i++) columns.push(f / aspect * r[i], f * u[i], a * b[i], -b[i]);
    columns.push(0, 0, a * -this.distance + c, this.distance);
    return new Float32Array(columns);
  }
}
