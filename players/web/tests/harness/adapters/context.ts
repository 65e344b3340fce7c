// A WebGL2 context without an engine: what GlScene does to its state, and into which pixels it draws.

import { GlScene } from "../../../src/engine/gl_scene.js";
import { EngineView } from "../../../src/engine/view.js";
import { load } from "../../../src/load.js";
import { FOV_Y, SIZE } from "./stage.js";

interface Case {
  readonly distance: number;
  readonly part?: readonly [x: number, y: number, width: number, height: number];
  readonly reversed?: boolean;
  readonly clipControl?: boolean; // depth in 0..1, as an engine with EXT_clip_control has it
  readonly colours?: number; // attachments of the target
  readonly noCopy?: boolean; // this browser cannot copy depth
  readonly noDepth?: boolean; // the target has none
}

const NAMES = [
  "VIEWPORT", "SCISSOR_BOX", "COLOR_WRITEMASK", "COLOR_CLEAR_VALUE", "DEPTH_FUNC", "DEPTH_WRITEMASK", "DEPTH_CLEAR_VALUE",
  "BLEND_EQUATION_RGB", "BLEND_EQUATION_ALPHA", "BLEND_SRC_RGB", "BLEND_DST_RGB", "BLEND_SRC_ALPHA", "BLEND_DST_ALPHA",
  "CURRENT_PROGRAM", "VERTEX_ARRAY_BINDING", "ARRAY_BUFFER_BINDING", "UNIFORM_BUFFER_BINDING", "RENDERBUFFER_BINDING",
  "DRAW_FRAMEBUFFER_BINDING", "READ_FRAMEBUFFER_BINDING", "ACTIVE_TEXTURE", "DRAW_BUFFER0", "DRAW_BUFFER1",
  "SCISSOR_TEST", "DEPTH_TEST", "CULL_FACE", "STENCIL_TEST", "BLEND", "RASTERIZER_DISCARD", "SAMPLE_ALPHA_TO_COVERAGE",
  "SAMPLE_COVERAGE", "POLYGON_OFFSET_FILL", "DITHER", "PACK_ALIGNMENT", "UNPACK_ALIGNMENT", "UNPACK_FLIP_Y_WEBGL",
] as const;

/** Values of the state by name; objects stay what they are. */
function stateOf(gl: WebGL2RenderingContext): Map<string, unknown> {
  const found = new Map<string, unknown>();
  const plain = (value: unknown): unknown => (ArrayBuffer.isView(value) || Array.isArray(value) ? String(value) : value);
  for (const name of NAMES) found.set(name, plain(gl.getParameter(gl[name])));
  const active = gl.getParameter(gl.ACTIVE_TEXTURE) as number;
  for (let unit = 0; unit < 3; unit++) {
    gl.activeTexture(gl.TEXTURE0 + unit);
    found.set(`texture ${unit}`, gl.getParameter(gl.TEXTURE_BINDING_2D));
    found.set(`sampler ${unit}`, gl.getParameter(gl.SAMPLER_BINDING));
    for (const name of ["BINDING", "START", "SIZE"] as const) {
      found.set(`block ${unit} ${name}`, gl.getIndexedParameter(gl[`UNIFORM_BUFFER_${name}`], unit));
    }
  }
  gl.activeTexture(active);
  return found;
}

/** Values that no engine leaves by chance. */
function disturb(gl: WebGL2RenderingContext): void {
  gl.scissor(0, 0, SIZE, SIZE);
  for (const name of ["SCISSOR_TEST", "CULL_FACE", "SAMPLE_ALPHA_TO_COVERAGE", "POLYGON_OFFSET_FILL", "STENCIL_TEST", "BLEND"] as const) gl.enable(gl[name]);
  gl.stencilFunc(gl.NEVER, 1, 1);
  gl.colorMask(true, false, true, false);
  gl.clearColor(0.1, 0.2, 0.3, 0.4);
  gl.depthFunc(gl.NOTEQUAL);
  gl.depthMask(true);
  gl.blendEquationSeparate(gl.FUNC_SUBTRACT, gl.FUNC_REVERSE_SUBTRACT);
  gl.blendFuncSeparate(gl.DST_COLOR, gl.ZERO, gl.SRC_ALPHA, gl.ONE_MINUS_DST_ALPHA);
  const program = gl.createProgram() as WebGLProgram;
  for (const [kind, text] of [[gl.VERTEX_SHADER, "void main(){gl_Position=vec4(0);}"], [gl.FRAGMENT_SHADER, "precision highp float;void main(){gl_FragColor=vec4(0);}"]] as const) {
    const shader = gl.createShader(kind) as WebGLShader;
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  gl.useProgram(program);
  gl.bindVertexArray(gl.createVertexArray());
  const buffer = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bindBuffer(gl.UNIFORM_BUFFER, buffer);
  gl.bufferData(gl.UNIFORM_BUFFER, 1024, gl.STATIC_DRAW);
  gl.bindBufferRange(gl.UNIFORM_BUFFER, 0, buffer, 256, 128);
  gl.bindBufferBase(gl.UNIFORM_BUFFER, 1, buffer);
  gl.bindRenderbuffer(gl.RENDERBUFFER, gl.createRenderbuffer());
  for (let unit = 0; unit < 3; unit++) {
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.bindSampler(unit, gl.createSampler());
  }
}

/** A target of `colours` images of bytes, black, whose left half has the least depth that hides everything. */
function target(gl: WebGL2RenderingContext, { colours = 1, reversed = false, noDepth = false }: Case): void {
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  const names: number[] = [];
  for (let i = 0; i < colours; i++) {
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, SIZE, SIZE);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, gl.TEXTURE_2D, texture, 0);
    names.push(gl.COLOR_ATTACHMENT0 + i);
  }
  gl.drawBuffers(names);
  gl.clearColor(0, 0, 0, 1);
  gl.clear(gl.COLOR_BUFFER_BIT);
  if (noDepth) return;
  const depth = gl.createRenderbuffer();
  gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
  gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT16, SIZE, SIZE);
  gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
  for (const [x, value] of [[0, reversed ? 1 : 0], [SIZE / 2, reversed ? 0 : 1]] as const) {
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(x, 0, SIZE / 2, SIZE);
    gl.clearDepth(value);
    gl.clear(gl.DEPTH_BUFFER_BIT);
  }
  gl.disable(gl.SCISSOR_TEST);
}

/** View and projection, column-major, of a camera on the z axis. */
function cameraOf({ distance, part, reversed, clipControl }: Case): { view: number[]; projection: number[] } {
  const [, , w, h] = part ?? [0, 0, SIZE, SIZE];
  const f = 1 / Math.tan(FOV_Y / 2), near = distance / 50, far = distance * 5;
  const [a, b] = reversed ? [far, near] : [near, far]; // where depth is least, and most
  const z = clipControl ? [-b / (b - a), (-b * a) / (b - a)] : [-(b + a) / (b - a), (-2 * b * a) / (b - a)];
  const projection = [(f * h) / w, 0, 0, 0, 0, f, 0, 0, 0, 0, z[0]!, -1, 0, 0, z[1]!, 0];
  return { view: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -distance, 1], projection };
}

/** Draws one avatar. Returns the names of states that changed, the errors, and the images, first row at the bottom. */
async function drawCase(file: string, one: Case): Promise<{ changed: string[]; errors: number[]; images: number[][] }> {
  const gl = new OffscreenCanvas(SIZE, SIZE).getContext("webgl2") as WebGL2RenderingContext;
  const avatar = await load(file);
  target(gl, one);
  disturb(gl);
  const [x, y, w, h] = one.part ?? [0, 0, SIZE, SIZE];
  gl.viewport(x, y, w, h);
  const clip = one.clipControl ? gl.getExtension("EXT_clip_control") : null;
  clip?.clipControlEXT(clip.LOWER_LEFT_EXT, clip.ZERO_TO_ONE_EXT);
  if (one.noCopy) gl.blitFramebuffer = () => gl.enable(0);
  const view = new EngineView();
  view.setViewport(x, y, w, h);
  view.reversed = one.reversed === true;
  const { view: fromWorld, projection } = cameraOf(one);
  view.setCamera(fromWorld, projection, one.clipControl ? "zero_to_one" : "minus_one_to_one", "bottom", SIZE, SIZE);
  const before = stateOf(gl);
  const scene = new GlScene(gl, true, () => undefined);
  scene.add(avatar, 0);
  scene.drawInto(view);
  const after = stateOf(gl);
  const changed = [...before.keys()].filter((name) => before.get(name) !== after.get(name));
  if (clip && gl.getParameter(clip.CLIP_DEPTH_MODE_EXT) !== clip.ZERO_TO_ONE_EXT) changed.push("clip depth");
  const images: number[][] = [];
  for (let i = 0; i < (one.colours ?? 1); i++) {
    const pixels = new Uint8Array(4 * SIZE * SIZE);
    gl.readBuffer(gl.COLOR_ATTACHMENT0 + i);
    gl.readPixels(0, 0, SIZE, SIZE, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    images.push([...pixels]);
  }
  scene.dispose();
  const errors: number[] = [];
  for (let code = gl.getError(); code !== gl.NO_ERROR; code = gl.getError()) errors.push(code);
  return { changed, errors, images };
}

/** The cases one after the other, each in a context of its own. */
async function play(file: string, cases: readonly Case[]): Promise<unknown[]> {
  const found: unknown[] = [];
  for (const one of cases) found.push(await drawCase(file, one));
  return found;
}

Object.assign(window, { play });
