// Keeps the state of a host's WebGL2 context while other code draws.

const DRAW_BUFFERS = 4; // that are looked at

/** What we use of extension EXT_clip_control: with it a host has depth in 0..1. */
interface ClipControl {
  readonly LOWER_LEFT_EXT: GLenum;
  readonly NEGATIVE_ONE_TO_ONE_EXT: GLenum;
  readonly CLIP_ORIGIN_EXT: GLenum;
  readonly CLIP_DEPTH_MODE_EXT: GLenum;
  clipControlEXT(origin: GLenum, depth: GLenum): void;
}

/** Reads what `GlScene` changes, and writes it back. Hosts cache their state: one that is changed behind them breaks them. */
export class GlState {
  /** The framebuffer that the host draws into; null: the canvas. */
  target: WebGLFramebuffer | null = null;
  /** The host's own scissor. */
  scissored = false;
  scissor: Int32Array = new Int32Array(4);
  private source: WebGLFramebuffer | null = null;
  private viewport: Int32Array = new Int32Array(4);
  private readonly capabilities: readonly GLenum[];
  private readonly enabled: boolean[] = [];
  private colorMask: readonly [boolean, boolean, boolean, boolean] = [true, true, true, true];
  private clearColor: Float32Array = new Float32Array(4);
  private depthFunc: GLenum = 0;
  private depthMask = true;
  private readonly blend: GLenum[] = []; // equations, then factors
  private program: WebGLProgram | null = null;
  private array: WebGLVertexArrayObject | null = null;
  private arrayBuffer: WebGLBuffer | null = null;
  private uniformBuffer: WebGLBuffer | null = null;
  private renderbuffer: WebGLRenderbuffer | null = null;
  private readonly blocks: (WebGLBuffer | null)[] = [];
  private readonly blockRanges: number[] = []; // start and size of each
  private readonly unpack: (number | boolean)[] = []; // of uploads, in the order of `unpacking`
  private readonly unpacking: readonly GLenum[];
  private unpackBuffer: WebGLBuffer | null = null;
  private activeTexture: GLenum = 0;
  private texture: WebGLTexture | null = null;
  private sampler: WebGLSampler | null = null;
  private readonly buffers: GLenum[] = []; // that `target` draws into
  private readonly only: GLenum[] = [];
  private readonly clip: ClipControl | null;
  private clipDepth: GLenum = 0;
  private clipOrigin: GLenum = 0;

  /** `units` is how many uniform blocks are bound. */
  constructor(private readonly gl: WebGL2RenderingContext, private readonly units: number) {
    this.capabilities = [
      gl.SCISSOR_TEST, gl.DEPTH_TEST, gl.CULL_FACE, gl.STENCIL_TEST, gl.BLEND, gl.RASTERIZER_DISCARD,
      gl.SAMPLE_ALPHA_TO_COVERAGE, gl.SAMPLE_COVERAGE, gl.POLYGON_OFFSET_FILL,
    ];
    this.unpacking = [
      gl.UNPACK_FLIP_Y_WEBGL, gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, gl.UNPACK_ALIGNMENT, gl.UNPACK_ROW_LENGTH,
      gl.UNPACK_SKIP_PIXELS, gl.UNPACK_SKIP_ROWS,
    ];
    this.clip = gl.getExtension("EXT_clip_control") as ClipControl | null;
  }

  save(): void {
    const { gl, capabilities } = this;
    this.target = gl.getParameter(gl.DRAW_FRAMEBUFFER_BINDING);
    this.source = gl.getParameter(gl.READ_FRAMEBUFFER_BINDING);
    this.viewport = gl.getParameter(gl.VIEWPORT);
    this.scissor = gl.getParameter(gl.SCISSOR_BOX);
    for (let i = 0; i < capabilities.length; i++) this.enabled[i] = gl.isEnabled(capabilities[i] as GLenum);
    this.scissored = this.enabled[0] as boolean;
    this.colorMask = gl.getParameter(gl.COLOR_WRITEMASK);
    this.clearColor = gl.getParameter(gl.COLOR_CLEAR_VALUE);
    this.depthFunc = gl.getParameter(gl.DEPTH_FUNC);
    this.depthMask = gl.getParameter(gl.DEPTH_WRITEMASK);
    this.saveBlend();
    this.saveBindings();
    for (let i = 0; i < this.unpacking.length; i++) this.unpack[i] = gl.getParameter(this.unpacking[i] as GLenum);
    this.unpackBuffer = gl.getParameter(gl.PIXEL_UNPACK_BUFFER_BINDING);
    this.saveBuffers();
    if (this.clip !== null) {
      this.clipDepth = gl.getParameter(this.clip.CLIP_DEPTH_MODE_EXT);
      this.clipOrigin = gl.getParameter(this.clip.CLIP_ORIGIN_EXT);
    }
  }

  /** What our shaders expect and set nowhere themselves. */
  prepare(): void {
    const { gl, clip } = this;
    gl.disable(gl.RASTERIZER_DISCARD);
    gl.disable(gl.SAMPLE_ALPHA_TO_COVERAGE);
    gl.disable(gl.SAMPLE_COVERAGE);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.depthMask(false);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindSampler(0, null);
    if (this.buffers.length > 0) {
      gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, this.target);
      gl.drawBuffers(this.only); // our shaders write one colour
    }
    clip?.clipControlEXT(clip.LOWER_LEFT_EXT, clip.NEGATIVE_ONE_TO_ONE_EXT);
  }

  restore(): void {
    const { gl, capabilities, viewport, scissor, colorMask, clearColor, blend } = this;
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, this.target);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.source);
    if (this.buffers.length > 0) gl.drawBuffers(this.buffers);
    gl.viewport(viewport[0] as number, viewport[1] as number, viewport[2] as number, viewport[3] as number);
    gl.scissor(scissor[0] as number, scissor[1] as number, scissor[2] as number, scissor[3] as number);
    for (let i = 0; i < capabilities.length; i++) {
      if (this.enabled[i]) gl.enable(capabilities[i] as GLenum);
      else gl.disable(capabilities[i] as GLenum);
    }
    gl.colorMask(colorMask[0], colorMask[1], colorMask[2], colorMask[3]);
    gl.clearColor(clearColor[0] as number, clearColor[1] as number, clearColor[2] as number, clearColor[3] as number);
    gl.depthFunc(this.depthFunc);
    gl.depthMask(this.depthMask);
    gl.blendEquationSeparate(blend[0] as GLenum, blend[1] as GLenum);
    gl.blendFuncSeparate(blend[2] as GLenum, blend[3] as GLenum, blend[4] as GLenum, blend[5] as GLenum);
    this.restoreBindings();
    for (let i = 0; i < this.unpacking.length; i++) gl.pixelStorei(this.unpacking[i] as GLenum, this.unpack[i] as number);
    gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, this.unpackBuffer);
    this.clip?.clipControlEXT(this.clipOrigin, this.clipDepth);
  }

  private saveBlend(): void {
    const { gl, blend } = this;
    blend[0] = gl.getParameter(gl.BLEND_EQUATION_RGB);
    blend[1] = gl.getParameter(gl.BLEND_EQUATION_ALPHA);
    blend[2] = gl.getParameter(gl.BLEND_SRC_RGB);
    blend[3] = gl.getParameter(gl.BLEND_DST_RGB);
    blend[4] = gl.getParameter(gl.BLEND_SRC_ALPHA);
    blend[5] = gl.getParameter(gl.BLEND_DST_ALPHA);
  }

  private saveBindings(): void {
    const { gl } = this;
    this.program = gl.getParameter(gl.CURRENT_PROGRAM);
    // A program that the host has deleted in use cannot be used again.
    if (this.program !== null && gl.getProgramParameter(this.program, gl.DELETE_STATUS)) this.program = null;
    this.array = gl.getParameter(gl.VERTEX_ARRAY_BINDING);
    this.arrayBuffer = gl.getParameter(gl.ARRAY_BUFFER_BINDING);
    this.uniformBuffer = gl.getParameter(gl.UNIFORM_BUFFER_BINDING);
    this.renderbuffer = gl.getParameter(gl.RENDERBUFFER_BINDING);
    for (let i = 0; i < this.units; i++) {
      const block = gl.getIndexedParameter(gl.UNIFORM_BUFFER_BINDING, i) as WebGLBuffer | null;
      this.blocks[i] = gl.isBuffer(block) ? block : null; // WebKit names those of a context that was lost
      this.blockRanges[2 * i] = gl.getIndexedParameter(gl.UNIFORM_BUFFER_START, i);
      this.blockRanges[2 * i + 1] = gl.getIndexedParameter(gl.UNIFORM_BUFFER_SIZE, i);
    }
    this.activeTexture = gl.getParameter(gl.ACTIVE_TEXTURE);
    gl.activeTexture(gl.TEXTURE0);
    this.texture = gl.getParameter(gl.TEXTURE_BINDING_2D);
    this.sampler = gl.getParameter(gl.SAMPLER_BINDING);
  }

  private restoreBindings(): void {
    const { gl } = this;
    gl.useProgram(this.program);
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.arrayBuffer);
    for (let i = 0; i < this.units; i++) {
      const block = this.blocks[i] as WebGLBuffer | null;
      const size = this.blockRanges[2 * i + 1] as number;
      if (block !== null && size > 0) gl.bindBufferRange(gl.UNIFORM_BUFFER, i, block, this.blockRanges[2 * i] as number, size);
      else gl.bindBufferBase(gl.UNIFORM_BUFFER, i, block);
    }
    gl.bindBuffer(gl.UNIFORM_BUFFER, this.uniformBuffer);
    gl.bindRenderbuffer(gl.RENDERBUFFER, this.renderbuffer);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.bindSampler(0, this.sampler);
    gl.activeTexture(this.activeTexture);
  }

  /** What a framebuffer with several colours draws into. */
  private saveBuffers(): void {
    const { gl, buffers, only } = this;
    buffers.length = only.length = 0;
    if (this.target === null) return;
    let used = 0;
    for (let i = 0; i < DRAW_BUFFERS; i++) {
      const buffer: GLenum = gl.getParameter(gl.DRAW_BUFFER0 + i);
      if (buffer !== gl.NONE) used = i + 1;
      buffers[i] = buffer;
      only[i] = i === 0 ? buffer : gl.NONE;
    }
    buffers.length = only.length = used > 1 ? used : 0;
  }
}
