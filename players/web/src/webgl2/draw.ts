// Draws quads into a float image, and composites that image once, in WebGL2.

import { AvatarError } from "../errors.js";
import { GLSL } from "../made/glsl.js";
import type { Background } from "../renderer.js";
import { Block } from "../uniforms.js";
import { QuadTexture } from "./quads.js";

const FLIP_Y = -1; // the first row of the image's texture is the top one

/** A uniform block in a buffer of its own. */
class GlBlock extends Block {
  private readonly buffer: WebGLBuffer;

  constructor(
    private readonly gl: WebGL2RenderingContext,
    entry: string,
    private readonly unit: number,
    constants: Record<string, number | number[]>,
  ) {
    super(entry, constants);
    this.buffer = gl.createBuffer() as WebGLBuffer;
  }

  bind(): void {
    const { gl } = this;
    gl.bindBufferBase(gl.UNIFORM_BUFFER, this.unit, this.buffer);
    gl.bufferData(gl.UNIFORM_BUFFER, this.words, gl.DYNAMIC_DRAW);
  }

  dispose(): void {
    this.gl.deleteBuffer(this.buffer);
  }
}

/** What is compiled once a context. */
export class GlPrograms {
  readonly splats: WebGLProgram;
  readonly compositor: WebGLProgram;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.splats = linked(gl, "raster_vertex_batch", "raster_pixel", 0);
    this.compositor = linked(gl, "composite_vertex", "composite_pixel", 1);
  }

  dispose(): void {
    for (const program of [this.splats, this.compositor]) this.gl.deleteProgram(program);
  }
}

/** The quads and the image. It leaves the state of the context changed. */
export class GlDraw {
  readonly quads: QuadTexture;
  private readonly empty: WebGLVertexArrayObject;
  private readonly raster: GlBlock;
  private readonly composite: GlBlock;
  private readonly format: number;
  private texture: WebGLTexture | null = null;
  private framebuffer: WebGLFramebuffer | null = null;
  private width = 0;
  private height = 0;

  private readonly programs: GlPrograms;

  /** `shared`: programs of the context; null: it makes its own. Throws AvatarError where the context cannot draw into floats. */
  constructor(
    private readonly gl: WebGL2RenderingContext,
    private readonly shared: GlPrograms | null,
  ) {
    const full = gl.getExtension("EXT_color_buffer_float") !== null;
    const half = full || gl.getExtension("EXT_color_buffer_half_float") !== null;
    if (!half) throw new AvatarError("this browser cannot draw into an image of floats", { field: "WebGL2" });
    this.format = full && gl.getExtension("EXT_float_blend") !== null ? gl.RGBA32F : gl.RGBA16F;
    this.raster = new GlBlock(gl, "raster_vertex", 0, { image_size: [1, 1], flip_y: FLIP_Y });
    this.composite = new GlBlock(gl, "composite_pixel", 1, { background: [0, 0, 0, 0], linear_target: 0, flip_rows: 1 });
    this.programs = shared ?? new GlPrograms(gl);
    this.quads = new QuadTexture(gl);
    this.empty = gl.createVertexArray() as WebGLVertexArrayObject;
  }

  /** Most splats that the context can draw. */
  get most(): number {
    return this.quads.most;
  }

  /** The framebuffer of the image; `begin` makes it. */
  get image(): WebGLFramebuffer {
    return this.framebuffer as WebGLFramebuffer;
  }

  /** Uploads quads: the first `count` of an array that quads.ts describes. */
  upload(floats: Float32Array<ArrayBuffer>, count: number): void {
    this.quads.upload(floats, count);
  }

  /** Draws `count` quads into the cleared image. */
  accumulate(count: number, width: number, height: number): void {
    this.begin(width, height);
    this.drawQuads(count, width, height, FLIP_Y);
  }

  /** Binds the image, cleared, of `width` x `height`, without a depth test. */
  begin(width: number, height: number): void {
    const { gl } = this;
    this.resize(width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.SCISSOR_TEST);
    gl.colorMask(true, true, true, true);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.disable(gl.DEPTH_TEST);
  }

  /** Draws `count` quads into what is bound, blended back to front; depth test and viewport are the caller's. */
  drawQuads(count: number, width: number, height: number, flipY: number): void {
    const { gl } = this;
    gl.useProgram(this.programs.splats);
    this.raster.set("image_size", 0, width);
    this.raster.set("image_size", 1, height);
    this.raster.set("flip_y", 0, flipY);
    this.raster.bind();
    gl.disable(gl.CULL_FACE);
    gl.disable(gl.STENCIL_TEST);
    gl.enable(gl.BLEND);
    gl.blendEquation(gl.FUNC_ADD);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    this.quads.draw(count);
  }

  /** Puts the image onto the canvas. */
  onto(background: Background): void {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, this.width, this.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.disable(gl.BLEND);
    this.compose(background, false, true);
  }

  /** Puts the image onto what is bound, pixel by pixel; blending is the caller's. `flipRows`: row 0 of the image is on top. */
  compose(background: Background, linearTarget: boolean, flipRows: boolean): void {
    const { gl } = this;
    for (let i = 0; i < 3; i++) this.composite.set("background", i, background?.[i] ?? 0);
    this.composite.set("background", 3, background === null ? 0 : 1);
    this.composite.set("linear_target", 0, linearTarget ? 1 : 0);
    this.composite.set("flip_rows", 0, flipRows ? 1 : 0);
    gl.useProgram(this.programs.compositor);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    this.composite.bind();
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindVertexArray(null);
  }

  /** The image as [H, W, 4], first row on top. */
  read(): Float32Array {
    const { gl } = this;
    const pixels = new Float32Array(4 * this.width * this.height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.finish(); // WebKitGTK reads what is not drawn yet
    gl.readPixels(0, 0, this.width, this.height, gl.RGBA, gl.FLOAT, pixels);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return pixels;
  }

  dispose(): void {
    const { gl } = this;
    for (const block of [this.raster, this.composite]) block.dispose();
    if (this.shared === null) this.programs.dispose();
    gl.deleteVertexArray(this.empty);
    this.quads.dispose();
    gl.deleteTexture(this.texture);
    gl.deleteFramebuffer(this.framebuffer);
  }

  private resize(width: number, height: number): void {
    if (width === this.width && height === this.height) return;
    const { gl } = this;
    gl.deleteTexture(this.texture);
    gl.deleteFramebuffer(this.framebuffer);
    this.texture = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, this.format, width, height);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    this.framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.texture, 0);
    this.width = width;
    this.height = height;
    this.composite.set("image_size", 0, width);
    this.composite.set("image_size", 1, height);
  }
}

/** A program of two entries, whose uniform blocks take block `unit`. `text` is that of `fragment`. */
export function linked(gl: WebGL2RenderingContext, vertex: string, fragment: string, unit: number, text = GLSL[fragment]): WebGLProgram {
  const program = gl.createProgram() as WebGLProgram;
  for (const [kind, source] of [[gl.VERTEX_SHADER, GLSL[vertex]], [gl.FRAGMENT_SHADER, text]] as const) {
    const shader = gl.createShader(kind) as WebGLShader;
    gl.shaderSource(shader, source as string);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    gl.deleteShader(shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new AvatarError(`shader ${fragment}: ${String(gl.getProgramInfoLog(program)).replace(/\s+/g, " ")}`, { field: "WebGL2" });
  }
  const blocks = gl.getProgramParameter(program, gl.ACTIVE_UNIFORM_BLOCKS) as number; // null where the context is lost
  for (let i = 0; i < blocks; i++) gl.uniformBlockBinding(program, i, unit);
  return program;
}
