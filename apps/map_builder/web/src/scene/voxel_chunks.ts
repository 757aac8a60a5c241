// SPDX-License-Identifier: Apache-2.0
// The voxels on the graphics card: one instanced geometry a chunk, with updates of the slots that changed.

import {
  DynamicDrawUsage, Group, InstancedBufferAttribute, InstancedBufferGeometry, Mesh, type ShaderMaterial, Sphere, Vector3,
} from "three";
import { Checksum } from "../stream/checksum";
import type { PerLevel } from "../stream/protocol";
import { CHUNK_BITS, type ChunkUpdate } from "../stream/voxel_store";
import { FACE_INDICES, type Uniforms, voxelMaterial } from "./voxel_material";

type VoxelMesh = Mesh<InstancedBufferGeometry, ShaderMaterial>;
interface DrawnChunk {
  mesh: VoxelMesh;
  attribute: InstancedBufferAttribute;
  update: Omit<ChunkUpdate, "words">;
}

const SMALLEST_CAPACITY = 128;

export class VoxelChunks {
  readonly group = new Group();
  private readonly chunks = new Map<number, DrawnChunk>();
  private readonly materials = new Map<string, ShaderMaterial>();

  constructor(private readonly shared: Uniforms) {}

  apply(updates: ChunkUpdate[]): void {
    for (const update of updates) {
      if (update.count === 0) this.remove(update.key);
      else this.change(update);
    }
  }

  private change(update: ChunkUpdate): void {
    let chunk = this.chunks.get(update.key);
    if (!chunk || chunk.attribute.count < update.count) chunk = this.grow(update, chunk);
    const { attribute, mesh } = chunk;
    attribute.array.set(update.words, 2 * update.from);
    attribute.addUpdateRange(2 * update.from, update.words.length);
    attribute.needsUpdate = true;
    mesh.geometry.instanceCount = update.count;
    const { words: _, ...rest } = update;
    chunk.update = rest;
  }

  /** A chunk with room for twice as many as needed now; keeps what the old one held. */
  private grow(update: ChunkUpdate, old: DrawnChunk | undefined): DrawnChunk {
    const capacity = old ? 2 * update.count : Math.max(SMALLEST_CAPACITY, Math.ceil(1.25 * update.count));
    const words = new Uint32Array(2 * capacity);
    if (old) words.set(old.attribute.array.subarray(0, 2 * old.update.count));
    const attribute = new InstancedBufferAttribute(words, 2);
    attribute.setUsage(DynamicDrawUsage);
    const geometry = new InstancedBufferGeometry();
    geometry.setAttribute("a_voxel", attribute);
    geometry.setIndex(FACE_INDICES);
    const edge = (1 << CHUNK_BITS[update.level]) * update.cell;
    // By hand: the geometry has no positions from which three.js could take it.
    geometry.boundingSphere = new Sphere(new Vector3(edge, edge, edge).multiplyScalar(0.5), (Math.sqrt(3) / 2) * edge);
    const mesh: VoxelMesh = old?.mesh ?? new Mesh(geometry, this.material(update.level, update.cell));
    if (old) {
      old.mesh.geometry.dispose();
      mesh.geometry = geometry;
    } else {
      mesh.position.set(...update.corner).multiplyScalar(update.cell);
      mesh.updateMatrix();
      mesh.matrixAutoUpdate = false;
      this.group.add(mesh);
    }
    const chunk = { mesh, attribute, update };
    this.chunks.set(update.key, chunk);
    return chunk;
  }

  private remove(key: number): void {
    const chunk = this.chunks.get(key);
    if (!chunk) return;
    this.group.remove(chunk.mesh);
    chunk.mesh.geometry.dispose();
    this.chunks.delete(key);
  }

  private material(level: number, cell: number): ShaderMaterial {
    const key = `${level}:${cell}`;
    let material = this.materials.get(key);
    if (!material) this.materials.set(key, (material = voxelMaterial(this.shared, level, cell)));
    return material;
  }

  /** What is on the card, counted and summed anew: for tests of the way from the socket to the picture. */
  audit(): { counts: PerLevel; checksum: string } {
    const counts: PerLevel = [0, 0, 0];
    const sum = new Checksum();
    for (const { attribute, update } of this.chunks.values()) {
      counts[update.level] += update.count;
      for (let i = 0; i < update.count; i++) {
        const [cell, info] = [attribute.array[2 * i], attribute.array[2 * i + 1]];
        const [x, y, z] = [0, 8, 16].map((shift, axis) => update.corner[axis] + ((cell >>> shift) & 255));
        sum.add(update.level, x, y, z, cell >>> 24, info >>> 24);
      }
    }
    return { counts, checksum: sum.hex() };
  }
}
