// A WebGL2 context without an engine: what GlScene does to its state, and into which pixels it draws.

import { GlScene } from "../../../src/engine/gl_scene.ts";
import { load } from "../../../src/load.ts";
import { FOV_Y, SIZE, makeCanvas, nothing, webGl } from "./stage.js";

const SWITCHES = ["SCISSOR_TEST", "CULL_FACE", "SAMPLE_ALPHA_TO_COVERAGE", "POLYGON_OFFSET_FILL", "STENCIL_TEST", "BLEND"];

/** All of the state by name; objects stay what they are. */
function stateOf(gl) {
  const plain = (value) => (ArrayBuffer.isView(value) || Array.isArray(value) ? String(value) : value);
  const constants = Object.entries(WebGL2RenderingContext).filter(([, code]) => typeof code === "number");
  const found = new Map(constants.map(([name, code]) => [name, plain(gl.getParameter(code))]));
  const active = gl.getParameter(gl.ACTIVE_TEXTURE);
  for (let unit = 0; unit < 3; unit++) {
    gl.activeTexture(gl.TEXTURE0 + unit);
    found.set(`texture ${unit}`, gl.getParameter(gl.TEXTURE_BINDING_2D));
    found.set(`sampler ${unit}`, gl.getParameter(gl.SAMPLER_BINDING));
    for (const name of ["BINDING", "START", "SIZE"]) {
      found.set(`block ${unit} ${name}`, gl.getIndexedParameter(gl[`UNIFORM_BUFFER_${name}`], unit));
    }
  }
  gl.activeTexture(active);
  while (gl.getError() !== gl.NO_ERROR); // of constants that name no state
  return found;
}

/** Values that no engine leaves by chance. */
function disturb(gl) {
  for (const name of SWITCHES) gl.enable(gl[name]);
  gl.scissor(0, 0, SIZE, SIZE);
  gl.stencilFunc(gl.NEVER, 1, 1);
  gl.colorMask(true, false, true, false);
  gl.clearColor(0.1, 0.2, 0.3, 0.4);
  gl.depthFunc(gl.NOTEQUAL);
  gl.depthMask(true);
  gl.blendEquationSeparate(gl.FUNC_SUBTRACT, gl.FUNC_REVERSE_SUBTRACT);
  gl.blendFuncSeparate(gl.DST_COLOR, gl.ZERO, gl.SRC_ALPHA, gl.ONE_MINUS_DST_ALPHA);
  const program = gl.createProgram();
  const fragment = "precision highp float;void main(){gl_FragColor=vec4(0);}";
  for (const [kind, text] of [[gl.VERTEX_SHADER, "void main(){gl_Position=vec4(0);}"], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
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
function target(gl, { colours = 1, reversed = false, noDepth = false }) {
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  const names = Array.from({ length: colours }, (_, i) => gl.COLOR_ATTACHMENT0 + i);
  for (const name of names) {
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, SIZE, SIZE);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, name, gl.TEXTURE_2D, texture, 0);
  }
  gl.drawBuffers(names);
  gl.clearColor(0, 0, 0, 1);
  gl.clear(gl.COLOR_BUFFER_BIT);
  if (noDepth) return;
  const depth = gl.createRenderbuffer();
  gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
  gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT16, SIZE, SIZE);
  gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
  gl.enable(gl.SCISSOR_TEST);
  for (const [x, value] of [[0, reversed ? 1 : 0], [SIZE / 2, reversed ? 0 : 1]]) {
    gl.scissor(x, 0, SIZE / 2, SIZE);
    gl.clearDepth(value);
    gl.clear(gl.DEPTH_BUFFER_BIT);
  }
  gl.disable(gl.SCISSOR_TEST);
}

/** Takes a camera on the z axis. */
function look(view, { distance, reversed = false, clipControl }) {
  const f = 1 / Math.tan(FOV_Y / 2), near = distance / 50, far = distance * 5;
  const [a, b] = reversed ? [far, near] : [near, far]; // where depth is least, and most
  const z = clipControl ? [-b / (b - a), (-b * a) / (b - a)] : [-(b + a) / (b - a), (-2 * b * a) / (b - a)];
  const projection = [f, 0, 0, 0, 0, f, 0, 0, 0, 0, z[0], -1, 0, 0, z[1], 0];
  const fromWorld = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -distance, 1];
  view.setViewport(0, 0, SIZE, SIZE);
  view.reversed = reversed;
  view.setCamera(fromWorld, projection, clipControl ? "zero_to_one" : "minus_one_to_one", "bottom", SIZE, SIZE);
}

/**
 * Draws one avatar. Returns the names of states that changed, the errors, and the images, first row at the bottom; with
 * `farther` (metres) the last one is that after the avatar was drawn once more, farther away.
 */
async function drawCase(file, one) {
  const gl = makeCanvas().getContext("webgl2", { antialias: false });
  const avatar = await load(file);
  target(gl, one);
  disturb(gl);
  gl.viewport(0, 0, SIZE, SIZE);
  const clip = one.clipControl ? gl.getExtension("EXT_clip_control") : null;
  clip?.clipControlEXT(clip.LOWER_LEFT_EXT, clip.ZERO_TO_ONE_EXT);
  if (one.noCopy) gl.blitFramebuffer = () => gl.enable(0);
  const before = stateOf(gl);
  const scene = await GlScene.create(gl, look, { synchronous: true, depthAlpha: one.depthAlpha }, nothing);
  const instance = scene.add(avatar, 0);
  scene.draw(one);
  const after = stateOf(gl);
  const changed = [...before.keys()].filter((name) => before.get(name) !== after.get(name));
  if (clip && gl.getParameter(clip.CLIP_DEPTH_MODE_EXT) !== clip.ZERO_TO_ONE_EXT) changed.push("clip depth");
  const read = (_, i) => {
    gl.finish();
    const pixels = new Uint8Array(4 * SIZE * SIZE);
    gl.readBuffer(gl.COLOR_ATTACHMENT0 + i);
    gl.readPixels(0, 0, SIZE, SIZE, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return [...pixels];
  };
  const images = Array.from({ length: one.colours ?? 1 }, read);
  if (one.farther) {
    instance.place[11] -= one.farther;
    scene.draw(one);
    images.push(read(null, 0));
  }
  scene.dispose();
  return { changed, errors: await webGl(gl).errors(), images };
}

/** The cases one after the other, each in a context of its own. */
async function play(file, cases) {
  const found = [];
  for (const one of cases) found.push(await drawCase(file, one));
  return found;
}

Object.assign(window, { play });
