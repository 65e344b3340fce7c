// The few vertices of the mesh whose motion moves an `anchor` group: decoded once, posed on the CPU.

import { AvatarError } from "../errors.js";
import { floatsOf, widthOf } from "../pack/content.js";
import type { Pass, Program, Section } from "../pack/model.js";

/** Sparse rows of vertices: entry e adds weights[column[e]] * value[e] to vertex row[e]. */
interface Entries {
  readonly row: Uint32Array;
  readonly column: Uint32Array;
  readonly value: Float64Array; // [E, channels]
}

/** The anchor vertices of a mesh, at rest and posed. */
export class Anchors {
  /** Neutral vertices [A, 3]. */
  readonly rest: Float64Array;
  /** Posed vertices [A, 3] of the newest `update`. */
  readonly posed: Float64Array;
  private readonly morphed: Float64Array;
  private readonly morphs: Entries;
  private readonly correctives: Entries;
  private readonly late: Entries;
  private readonly skin: Entries;

  /** `vertices` [A] are decoded from the mesh of a program that has been checked. */
  constructor(program: Program, vertices: Uint32Array) {
    const morph = (v: number): Rows => rowsOf(program, "morph", "MorphStatic", v);
    const skin = (v: number): Rows => rowsOf(program, "skin", "SkinStatic", v);
    this.rest = new Float64Array(3 * vertices.length);
    vertices.forEach((vertex, a) => this.rest.set(template(morph(vertex)), 3 * a));
    this.morphed = new Float64Array(this.rest.length);
    this.posed = this.rest.slice();
    this.morphs = gather(vertices, morph, "morph", "morph_position");
    this.correctives = gather(vertices, morph, "corrective", "corrective_position");
    this.late = gather(vertices, skin, "late", "late_position");
    this.skin = gather(vertices, skin, "skin", "skin_weight");
  }

  /** Stages morph and skin: weights [K], features [9 C], late weights [L], skin matrices [J, 3, 4]. */
  update(weights: Float32Array, features: Float32Array, late: Float32Array, matrices: Float64Array): void {
    this.morphed.set(this.rest);
    add(this.morphed, this.morphs, weights);
    add(this.morphed, this.correctives, features);
    this.posed.fill(0);
    const { row, column, value } = this.skin;
    for (let e = 0; e < row.length; e++) {
      const at = 3 * (row[e] as number);
      const weight = value[e] as number;
      const x = this.morphed[at] as number, y = this.morphed[at + 1] as number, z = this.morphed[at + 2] as number;
      for (let c = 0, m = 12 * (column[e] as number); c < 3; c++, m += 4) {
        const turned = (matrices[m] as number) * x + (matrices[m + 1] as number) * y + (matrices[m + 2] as number) * z;
        this.posed[at + c] = (this.posed[at + c] as number) + weight * (turned + (matrices[m + 3] as number));
      }
    }
    add(this.posed, this.late, late);
  }
}

function add(to: Float64Array, { row, column, value }: Entries, weights: Float32Array): void {
  for (let e = 0; e < row.length; e++) {
    const weight = weights[column[e] as number] as number;
    if (weight !== 0) {
      const at = 3 * (row[e] as number);
      to[at] = (to[at] as number) + weight * (value[3 * e] as number);
      to[at + 1] = (to[at + 1] as number) + weight * (value[3 * e + 1] as number);
      to[at + 2] = (to[at + 2] as number) + weight * (value[3 * e + 2] as number);
    }
  }
}

/** One row of a packed buffer: the pass that reads it, and its place there. */
interface Rows {
  readonly one: Pass;
  readonly sections: ReadonlyMap<string, Section>;
  readonly row: number;
}

function rowsOf(program: Program, entry: string, buffer: string, vertex: number): Rows {
  for (const one of program.mesh) {
    const row = vertex - (one.constants["first"] as number);
    if (one.entry === entry && row >= 0 && row < (one.constants["count"] as number)) {
      const held = program.buffers.get(one.buffers[buffer] as string);
      return { one, sections: new Map((held?.sections ?? []).map((section) => [section.name, section])), row };
    }
  }
  const field = "array rig.anchor_vertices";
  throw new AvatarError(`no pass poses vertex ${vertex}, which an anchor group follows`, { field });
}

function template({ one, sections, row }: Rows): Float64Array {
  const count = one.constants["count"] as number;
  const section = sections.get("template_position") as Section;
  const width = one.constants["template_position_width"] as number;
  const found = new Float64Array(3);
  const scale = width === 32 ? null : floatsOf(sections.get("template_position_scale") as Section);
  for (let c = 0; c < 3; c++) {
    const at = c * count + row;
    if (scale === null) {
      found[c] = floatsOf(section)[at] as number;
    } else {
      const code = width === 0 ? 0 : (section.elements[at] as number);
      found[c] = Math.fround((scale[2 * c] as number) + Math.fround((scale[2 * c + 1] as number) * code));
    }
  }
  return found;
}

/** The entries of part `name` of all vertices; values of three channels, or of one for skin weights. */
function gather(vertices: Uint32Array, rows: (vertex: number) => Rows, name: string, values: string): Entries {
  const row: number[] = [];
  const column: number[] = [];
  const value: number[] = [];
  vertices.forEach((vertex, a) => {
    const at = rows(vertex);
    const ptr = (at.sections.get(`${name}_ptr`) as Section).elements;
    const columns = (at.sections.get(`${name}_column`) as Section).elements;
    for (let e = ptr[at.row] as number; e < (ptr[at.row + 1] as number); e++) {
      row.push(a);
      column.push(columns[e] as number);
      value.push(...decoded(at, values, e, columns[e] as number));
    }
  });
  return { row: Uint32Array.from(row), column: Uint32Array.from(column), value: Float64Array.from(value) };
}

function decoded({ one, sections }: Rows, name: string, entry: number, column: number): number[] {
  const weights = name === "skin_weight";
  const channels = weights ? [0] : [0, 1, 2];
  const section = sections.get(name) as Section;
  const width = one.constants[`${name}_width`] as number;
  if (width === 0) {
    return channels.map(() => 0); // of signed codes the middle, of weights the code 0
  }
  if (widthOf(section) === 32) {
    const floats = floatsOf(section);
    return channels.map((c) => floats[channels.length * entry + c] as number);
  }
  const steps = floatsOf(sections.get(`${name}_step`) as Section);
  const middle = weights ? 0 : 2 ** (width - 1);
  return channels.map((c) => {
    const step = steps[weights ? 0 : 3 * column + c] as number;
    return Math.fround(step * ((section.elements[channels.length * entry + c] as number) - middle));
  });
}
