// Checks a whole program before anything is uploaded: no pass that is accepted leaves its buffers.
//
// Every pass is held to the access contract of its entry. What concerns several passes is here: buffers, the layout of
// Pose, the order of passes, chunks, and the work of a frame.

import { AvatarError } from "../errors.js";
import { Access, type Held, type Interfaces, isU32, type PoseSection } from "./access.js";
import { checkChunks, chunkOf, levelNames } from "./chunks.js";
import { WORD, wordsOf } from "./content.js";
import { bindMesh, type Buffer, FRAME_SOURCES, type Level, type Pass, type Program } from "./model.js";
import { Packed } from "./packed.js";

const MOST_BYTES = 2 ** 31 - 1; // of one buffer: sizes in OpenGL's interface are signed
const MOST_BYTES_IN_ALL = 2 ** 32;
const MOST_PASSES = 2 ** 14; // of one list
const MOST_WORK = 2 ** 28; // rows and entries of one frame of a level
const WORK_RATIO = 16; // and at most so many a byte of the file
const MOST_COLUMNS = 2 ** 16; // of a section of Pose
const JOINT_FLOATS = 12;
const POSE_SECTIONS = ["weights", "features", "late", "joints"] as const;
const HOST_BUFFERS = ["Pose", "Mesh"]; // players write them, so they are bound by these names
const CHUNK_BUFFERS = ["Splats", "Sh", "Projected"] as const;
const STAGES = { mesh: ["morph", "skin"], deform: ["blend", "bind", "activate"], view: ["project"], shadow: ["shadow"], light: ["light"] } as const;
const SOURCES = {
  // list of passes -> beginnings of names of the frame that it may ask for
  mesh: [] as string[],
  deform: ["world_", "group_"],
  view: ["camera_", "clip_", "eye", "tan_half_fov", "image_size"],
  shadow: ["shadow_row", "world_row"],
  light: ["light_", "shadow_", "world_quat"],
};
const TABLE = "group_"; // names that begin so have a row a group
const SOURCE = /^([a-z0-9_]+)(?:\[([0-9]{1,9})\])?$/;

type List = keyof typeof STAGES;

/**
 * Throws AvatarError for a program that would read or write outside its buffers, or work without bound. `groups` is
 * how many groups of Gaussians the avatar has, `bytes` the size of the file. The field says which pass and which constant, section or buffer.
 */
export function checkProgram(program: Program, groups: number, interfaces: Interfaces, bytes = Infinity): void {
  new Checker(program, groups, interfaces, Math.min(MOST_WORK, WORK_RATIO * bytes)).check();
}

class Checker {
  private readonly packed = new Map<string, Packed>();
  private readonly pose = new Map<string, PoseSection>();
  private readonly roles = new Map<string, string>(); // buffer without sections -> the one name that shaders give it
  private readonly touched = new Map<string, number>(); // bytes of it that passes touch
  private readonly agreed = new Map<string, number>(); // buffer or entry, constant -> value
  private readonly held: Held;

  constructor(
    private readonly program: Program,
    private readonly groups: number,
    private readonly interfaces: Interfaces,
    private readonly mostWork: number,
  ) {
    this.held = { buffers: program.buffers, packed: this.packed, pose: this.pose };
  }

  check(): void {
    this.checkBuffers();
    this.checkPose();
    const written = new Set<string>();
    const work = this.checkList("mesh", "mesh", this.program.mesh, written, null);
    this.checkMesh();
    if (this.program.levels.length === 0) throw new AvatarError("there is none", { field: "levels" });
    this.program.levels.forEach((level, index) => this.checkLevel(`level ${index}`, level, written, work));
    if (new Set(this.program.levels.map((level) => level.prefix)).size < this.program.levels.length) {
      throw new AvatarError("two levels have the same prefix", { field: "levels" });
    }
    this.checkSizes();
  }

  private checkBuffers(): void {
    let total = 0;
    for (const [name, buffer] of this.program.buffers) {
      if (!isU32(buffer.bytes) || buffer.bytes > MOST_BYTES) {
        throw new AvatarError(`has ${buffer.bytes} bytes; ${MOST_BYTES} are the most`, { field: ofBuffer(name) });
      }
      total += buffer.bytes;
      if (buffer.sections.length > 0) {
        checkPacked(buffer);
        this.packed.set(name, new Packed(buffer));
      }
    }
    if (total > MOST_BYTES_IN_ALL) {
      throw new AvatarError(`have ${total} bytes; ${MOST_BYTES_IN_ALL} are the most`, { field: "buffers" });
    }
  }

  /** Sections of Pose follow each other without a gap. */
  private checkPose(): void {
    const { pose, poseFloats } = this.program;
    if (pose.weights !== 0) throw new AvatarError(`weights begins at ${pose.weights}, not at 0`, { field: "pose" });
    POSE_SECTIONS.forEach((name, index) => {
      const next = POSE_SECTIONS[index + 1];
      const end = next === undefined ? poseFloats : pose[next];
      const floats = name === "joints" ? JOINT_FLOATS : 1;
      const length = end - pose[name];
      if (!(length >= 0 && length <= floats * MOST_COLUMNS) || length % floats !== 0) {
        throw new AvatarError(`${name} takes ${length} floats`, { field: "pose" });
      }
      this.pose.set(name, { first: pose[name], items: length / floats });
    });
  }

  /** Stage morph moves every vertex once, run after run, and then stage skin where there are joints. */
  private checkMesh(): void {
    const { mesh, pose, poseFloats } = this.program;
    const vertices = (mesh[0]?.constants["vertices"] ?? 0) as number;
    const stages: string[] = [];
    let at = vertices;
    let sound = true;
    for (const one of mesh) {
      if (at === vertices) {
        stages.push(one.entry);
        at = 0;
      }
      sound &&= one.entry === stages[stages.length - 1] && one.constants["first"] === at;
      at += one.constants["count"] as number;
    }
    const needed = mesh.length === 0 ? "" : poseFloats > pose.joints ? "morph,skin" : "morph";
    if (!sound || at !== vertices || stages.join() !== needed) {
      throw new AvatarError("passes do not move every vertex once a stage", { field: "mesh" });
    }
  }

  private checkLevel(place: string, level: Level, written: ReadonlySet<string>, workBefore: number): void {
    checkChunks(place, level);
    const known = new Set(written);
    let work = workBefore + this.checkList(`${place}, deform`, "deform", level.deform, known, level);
    work += this.checkList(`${place}, view`, "view", level.view, known, level);
    if (level.light.length > 0) {
      work += this.checkList(`${place}, shadow`, "shadow", level.shadow, known, level);
      work += this.checkList(`${place}, light`, "light", level.light, known, level);
    } else if (level.shadow.length > 0) {
      throw new AvatarError("casts shadows that no pass reads", { field: `${place}, shadow` });
    }
    if (work > this.mostWork) {
      throw new AvatarError(`has ${work} rows and entries a frame; ${this.mostWork} are the most`, { field: place });
    }
    for (const which of ["view", "light"] as const) {
      const drawn = byBuffer(level[which], "Projected");
      for (const name of level[which].length > 0 ? levelNames(level, "Projected") : []) {
        const times = drawn.get(name)?.length ?? 0;
        if (times !== 1) throw new AvatarError(`${times} passes write ${name}; one is needed`, { field: `${place}, ${which}` });
      }
    }
    if (this.program.readsMesh !== bindMesh(level.deform)) {
      throw new AvatarError(`is ${this.program.readsMesh}; the passes of ${place} differ`, { field: "reads_mesh" });
    }
    this.checkPlaced(place, level);
  }

  /** Every chunk is blended once, and placed: by one pass over the mesh, or by passes that share one buffer. */
  private checkPlaced(place: string, level: Level): void {
    const written = byBuffer(level.deform, "Splats");
    for (const name of levelNames(level, "Splats")) {
      const bound = (kind: string): string[] => (written.get(name) ?? []).flatMap((one) => one.buffers[kind] ?? []);
      const embedded = bound("EmbedStatic").length;
      const skinned = new Set(bound("BindStatic")).size;
      const meshes = this.program.readsMesh ? 1 : 0;
      if (bound("BlendStatic").length !== 1 || embedded !== meshes || skinned !== 1 - meshes) {
        throw new AvatarError(`${name} is not blended once and placed`, { field: `${place}, deform` });
      }
    }
  }

  /** The rows and entries of all passes; buffers that they write join `written`. */
  private checkList(
    place: string,
    which: List,
    passes: readonly Pass[],
    written: Set<string>,
    level: Level | null,
  ): number {
    if (passes.length > MOST_PASSES) {
      throw new AvatarError(`has ${passes.length} passes; ${MOST_PASSES} are the most`, { field: place });
    }
    if (level !== null && passes.length === 0) throw new AvatarError("has no passes", { field: place });
    const stages: readonly string[] = STAGES[which];
    let work = 0;
    let reached = 0;
    passes.forEach((one, index) => {
      const access = new Access(`${place} pass ${index}`, one, this.held, this.interfaces);
      const stage = stages.indexOf(access.stage);
      if (stage < reached || (index === 0 && stage !== 0)) {
        throw access.error("entry", `stage ${access.stage} is out of place; the order is ${stages.join(", ")}`);
      }
      reached = stage;
      access.checkConstants();
      this.checkSources(access, which);
      this.checkBound(access, written);
      if (level !== null) this.checkChunk(access, level, place.split(",")[0] as string);
      work += one.rows + access.checkSections();
    });
    return work;
  }

  private checkSources(access: Access, which: List): void {
    for (const [name, value] of Object.entries(access.one.constants)) {
      if (typeof value !== "string") continue;
      const found = SOURCE.exec(value);
      const source = found?.[1] ?? "";
      const row = found?.[2];
      const floats = Object.hasOwn(FRAME_SOURCES, source) ? FRAME_SOURCES[source] : undefined;
      if (floats === undefined || !SOURCES[which].some((begin) => source.startsWith(begin))) {
        throw access.error(name, `'${value.slice(0, 80)}' is no value of the frame for these passes`);
      }
      if (access.types.get(name) !== `float${floats}`) {
        throw access.error(name, `'${value}' has ${floats} floats; a ${access.types.get(name)} is needed`);
      }
      if ((row !== undefined) !== source.startsWith(TABLE)) {
        throw access.error(name, `'${value}' needs ${row === undefined ? "a row, NAME[i]" : "no row"}`);
      }
      if (row !== undefined && Number(row) >= this.groups) {
        throw access.error(name, `'${value}' is beyond the ${this.groups} groups`);
      }
    }
  }

  /** Buffers without sections: one name each, written before they are read, large enough, agreed upon. */
  private checkBound(access: Access, written: Set<string>): void {
    const touched = access.touched();
    for (const [name, bound] of Object.entries(access.one.buffers)) {
      if (!access.packedNames.has(name)) {
        this.checkRole(access, name, bound, written);
        const item = access.storage.get(name);
        const bytes = (item?.stride ?? 0) * (touched.get(name) ?? 0);
        this.touched.set(bound, Math.max(this.touched.get(bound) ?? 0, bytes));
        const held = this.program.buffers.get(bound)?.bytes ?? 0;
        if (bytes > held) throw access.error(name, `takes ${bytes} bytes; '${bound}' has ${held}`);
      }
    }
    for (const [name, constants] of Object.entries(access.contract.same ?? {})) {
      this.agree(access, access.one.buffers[name] as string, constants);
    }
    for (const item of access.storage.values()) {
      if (!item.readonly) written.add(access.one.buffers[item.name] as string);
    }
  }

  private checkRole(access: Access, name: string, bound: string, written: ReadonlySet<string>): void {
    const role = this.roles.get(bound) ?? name;
    this.roles.set(bound, role);
    if (role !== name) throw access.error(name, `'${bound}' is bound as ${role} elsewhere`);
    if (HOST_BUFFERS.includes(name) && bound !== name) {
      throw access.error(name, `is bound to '${bound}'; players write buffer '${name}'`);
    }
    if (access.storage.get(name)?.readonly === true && !written.has(bound) && name !== "Pose") {
      throw access.error(name, `no earlier pass writes '${bound}'`);
    }
  }

  private agree(access: Access, what: string, constants: readonly string[]): void {
    for (const constant of constants) {
      const key = `${what}\n${constant}`;
      const value = access.count(constant);
      const first = this.agreed.get(key) ?? value;
      this.agreed.set(key, first);
      if (first !== value) throw access.error(constant, `is ${value}; an earlier pass over ${what} has ${first}`);
    }
  }

  private checkChunk(access: Access, level: Level, place: string): void {
    this.agree(access, `${place} (${access.one.entry})`, access.contract.level ?? []);
    const constant = access.contract.chunk;
    if (constant === undefined) return;
    let chunk = -1;
    for (const kind of CHUNK_BUFFERS) {
      const bound = access.one.buffers[kind];
      if (bound !== undefined) {
        const index = chunkOf(level, kind, bound);
        if (index < 0 || (chunk >= 0 && chunk !== index)) {
          throw access.error(kind, `'${bound}' is no buffer of this chunk`);
        }
        chunk = index;
      }
    }
    const rows = level.chunks[chunk]?.count;
    if (rows !== undefined && access.count(constant) !== rows) {
      throw access.error(constant, `is ${access.count(constant)}; chunk ${chunk} has ${rows} rows`);
    }
  }

  /** Buffers without sections are as large as what is touched, so that a small file takes little memory. */
  private checkSizes(): void {
    if (this.program.buffers.get("Pose")?.sections.length === 0) {
      this.touched.set("Pose", WORD * this.program.poseFloats);
    }
    for (const [name, buffer] of this.program.buffers) {
      const touched = this.touched.get(name) ?? 0;
      if (buffer.sections.length === 0 && buffer.bytes !== touched) {
        throw new AvatarError(`has ${buffer.bytes} bytes; passes touch ${touched}`, { field: ofBuffer(name) });
      }
    }
  }
}

/** The passes that bind each buffer as `kind`. */
function byBuffer(passes: readonly Pass[], kind: string): Map<string, Pass[]> {
  const found = new Map<string, Pass[]>();
  for (const one of passes) {
    const name = one.buffers[kind];
    if (name === undefined) continue;
    const others = found.get(name);
    if (others === undefined) found.set(name, [one]);
    else others.push(one);
  }
  return found;
}

function checkPacked(buffer: Buffer): void {
  const names = new Set<string>();
  let words = 0;
  for (const section of buffer.sections) {
    if (names.has(section.name)) {
      throw new AvatarError("is a duplicate", { field: ofBuffer(buffer.name, section.name) });
    }
    names.add(section.name);
    words += wordsOf(section.elements);
  }
  if (buffer.bytes !== WORD * words) {
    const field = ofBuffer(buffer.name);
    throw new AvatarError(`has ${buffer.bytes} bytes; its sections take ${WORD * words}`, { field });
  }
}

function ofBuffer(name: string, section = ""): string {
  return `buffer ${name.slice(0, 80)}${section === "" ? "" : `, ${section.slice(0, 80)}`}`;
}
