// SPDX-License-Identifier: Apache-2.0
// WebGL2 drawing: voxels as instances of the three faces of a cube that the eye can see, straight from the records of
// the stream (8 bytes a voxel, no matrices), and lines of constant width in pixels.

const VOXEL_VERTEX = `#version 300 es
precision highp float;
layout(location = 0) in ivec3 a_cell;   // relative to the level's origin
layout(location = 1) in uvec2 a_info;   // intensity, flags
uniform mat4 u_matrix;
uniform vec3 u_origin;                  // corner of the origin cell, relative to the camera's target
uniform vec3 u_eye;
uniform float u_size, u_target_y, u_cut, u_low, u_high;
uniform int u_colour;
uniform vec3 u_level_colour;
uniform float u_level_light;
out vec3 v_colour;

vec3 ramp(float t) {                    // blue, cyan, green, yellow, red
  t = clamp(t, 0.0, 1.0) * 4.0;
  return clamp(vec3(abs(t - 3.0) < 2.0 ? t - 2.0 : 0.0, t < 2.0 ? t : 4.0 - t, 2.0 - t), 0.0, 1.0);
}

void main() {
  int axis = gl_VertexID / 6, corner = gl_VertexID % 6;
  vec3 centre = u_origin + (vec3(a_cell) + 0.5) * u_size;
  float u = (corner == 1 || corner == 2 || corner == 4) ? 1.0 : -1.0;
  float v = (corner == 2 || corner == 4 || corner == 5) ? 1.0 : -1.0;
  float side = u_eye[axis] > centre[axis] ? 1.0 : -1.0;
  vec3 offset = axis == 0 ? vec3(side, u, v) : axis == 1 ? vec3(u, side, v) : vec3(u, v, side);
  vec3 p = centre + 0.47 * u_size * offset;
  float light = axis == 1 ? 1.0 : axis == 0 ? 0.78 : 0.62;
  float height = centre.y + u_target_y;
  vec3 colour = u_colour == 1 ? u_level_colour
      : u_colour == 2 ? mix(vec3(0.10, 0.14, 0.25), vec3(1.0, 0.95, 0.75), float(a_info.x) / 255.0)
      : mix(vec3(0.55), ramp((height - u_low) / max(u_high - u_low, 0.1)), 0.75);
  v_colour = colour * light * u_level_light;
  gl_Position = height > u_cut ? vec4(2.0, 2.0, 2.0, 1.0) : u_matrix * vec4(p, 1.0);
}`;

const LINE_VERTEX = `#version 300 es
precision highp float;
layout(location = 0) in vec3 a_from;
layout(location = 1) in vec3 a_to;
uniform mat4 u_matrix;
uniform vec3 u_target;
uniform vec2 u_pixel;                   // clip units per half line width
uniform vec3 u_line_colour;
out vec3 v_colour;

void main() {
  vec4 from = u_matrix * vec4(a_from - u_target, 1.0), to = u_matrix * vec4(a_to - u_target, 1.0);
  const float nearest = 0.05;           // keeps ends behind the eye from flipping over
  if (from.w < nearest) from = mix(from, to, (nearest - from.w) / (to.w - from.w));
  if (to.w < nearest) to = mix(to, from, (nearest - to.w) / (from.w - to.w));
  vec2 along = (to.xy / to.w - from.xy / from.w) / u_pixel;
  float length_px = length(along);
  vec2 across = length_px > 0.0 ? vec2(-along.y, along.x) / length_px : vec2(0.0, 1.0);
  vec4 end = gl_VertexID < 2 ? from : to;
  float side = gl_VertexID % 2 == 0 ? 1.0 : -1.0;
  gl_Position = end + vec4(across * side * u_pixel * end.w, 0.0, 0.0);
  v_colour = u_line_colour;
}`;

const FRAGMENT = `#version 300 es
precision mediump float;
in vec3 v_colour;
out vec4 colour;
void main() { colour = vec4(v_colour, 1.0); }`;

const LEVEL_COLOURS = [[0.30, 0.76, 1.0], [0.62, 0.55, 1.0], [0.73, 0.54, 0.37]];
const LEVEL_LIGHT = [1.0, 0.78, 0.55];

export class Scene {
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!this.gl) throw new Error("this browser offers no WebGL2");
    this.voxelProgram = this.program(VOXEL_VERTEX);
    this.lineProgram = this.program(LINE_VERTEX);
    this.levels = [0, 1, 2].map(() => this.voxelBuffer());
    this.lines = new Map();
    this.gl.enable(this.gl.DEPTH_TEST);
    this.gl.clearColor(0.043, 0.059, 0.078, 1);
  }

  program(vertexSource) {
    const gl = this.gl, program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertexSource], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    const uniforms = {};
    for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
      const { name } = gl.getActiveUniform(program, i);
      uniforms[name] = gl.getUniformLocation(program, name);
    }
    return { program, uniforms };
  }

  voxelBuffer() {
    const gl = this.gl, array = gl.createVertexArray(), buffer = gl.createBuffer();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribIPointer(0, 3, gl.SHORT, 8, 0);
    gl.vertexAttribDivisor(0, 1);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribIPointer(1, 2, gl.UNSIGNED_BYTE, 8, 6);
    gl.vertexAttribDivisor(1, 1);
    return { array, buffer, count: 0 };
  }

  setLevels(levels) {
    const gl = this.gl;
    levels.forEach((level, i) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.levels[i].buffer);
      gl.bufferData(gl.ARRAY_BUFFER, level.records, gl.DYNAMIC_DRAW);
      Object.assign(this.levels[i], { count: level.count, cell: level.cell, origin: level.origin });
    });
  }

  /** Points xyz xyz ...: a strip (each point joined to the next) or pairs. World coordinates. */
  setLine(name, points, { strip, colour, width }) {
    const gl = this.gl;
    let line = this.lines.get(name);
    if (!line) this.lines.set(name, line = { array: gl.createVertexArray(), buffer: gl.createBuffer(), visible: true });
    gl.bindVertexArray(line.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, line.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, points, gl.DYNAMIC_DRAW);
    for (const location of [0, 1]) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, 3, gl.FLOAT, false, strip ? 12 : 24, 12 * location);
      gl.vertexAttribDivisor(location, 1);
    }
    line.count = strip ? Math.max(0, points.length / 3 - 1) : points.length / 6;
    Object.assign(line, { colour, width });
  }

  draw(camera, { colourMode, cutHeight, low, high }) {
    const gl = this.gl, ratio = Math.min(2, window.devicePixelRatio || 1);
    const width = Math.round(this.canvas.clientWidth * ratio), height = Math.round(this.canvas.clientHeight * ratio);
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const matrix = camera.matrix();
    this.drawVoxels(camera, matrix, { colourMode, cutHeight, low, high });
    this.drawLines(camera, matrix, [ratio / width, ratio / height]);
  }

  drawVoxels(camera, matrix, { colourMode, cutHeight, low, high }) {
    const gl = this.gl, { program, uniforms } = this.voxelProgram;
    gl.useProgram(program);
    gl.uniformMatrix4fv(uniforms.u_matrix, false, matrix);
    gl.uniform3fv(uniforms.u_eye, camera.eye());
    gl.uniform1f(uniforms.u_target_y, camera.target[1]);
    gl.uniform1f(uniforms.u_cut, cutHeight);
    gl.uniform1f(uniforms.u_low, low);
    gl.uniform1f(uniforms.u_high, high);
    gl.uniform1i(uniforms.u_colour, colourMode);
    this.levels.forEach((level, i) => {
      if (level.count === 0) return;
      gl.uniform1f(uniforms.u_size, level.cell);
      // In doubles here, so that a float in the shader only ever holds small numbers.
      gl.uniform3fv(uniforms.u_origin, level.origin.map((index, axis) => index * level.cell - camera.target[axis]));
      gl.uniform3fv(uniforms.u_level_colour, LEVEL_COLOURS[i]);
      gl.uniform1f(uniforms.u_level_light, LEVEL_LIGHT[i]);
      gl.bindVertexArray(level.array);
      gl.drawArraysInstanced(gl.TRIANGLES, 0, 18, level.count);
    });
  }

  drawLines(camera, matrix, pixel) {
    const gl = this.gl, { program, uniforms } = this.lineProgram;
    gl.useProgram(program);
    gl.disable(gl.DEPTH_TEST);
    gl.uniformMatrix4fv(uniforms.u_matrix, false, matrix);
    gl.uniform3fv(uniforms.u_target, camera.target);
    for (const line of this.lines.values()) {
      if (!line.visible || line.count === 0) continue;
      gl.uniform2fv(uniforms.u_pixel, pixel.map((value) => value * line.width));
      gl.uniform3fv(uniforms.u_line_colour, line.colour);
      gl.bindVertexArray(line.array);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, line.count);
    }
    gl.enable(gl.DEPTH_TEST);
  }
}
