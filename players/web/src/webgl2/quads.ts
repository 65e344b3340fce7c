// Quads in a texture, drawn in batches by raster_vertex_batch: software and some GPUs are slow at instances of four
// vertices.

import { QUAD_BATCH as BATCH, QUAD_ROW as ROW } from "../made/constants.js";

const TEXELS = 3; // of a splat
const FLOATS = 4 * TEXELS;
const WIDTH = TEXELS * ROW; // every WebGL2 has textures of 2048 texels
const CORNERS = [0, 1, 2, 2, 1, 3]; // two triangles of a strip of four vertices
const UNIT = 0; // texture unit

/** Floats of an array for `upload` that holds up to `splats` splats: whole rows of the texture. */
export function floatsOfQuads(splats: number): number {
  return FLOATS * ROW * Math.ceil(splats / ROW);
}

/** Clears what `upload` and `draw` read behind the first `count` splats. */
export function endQuads(quads: Float32Array, count: number): void {
  quads.fill(0, FLOATS * count, FLOATS * BATCH * Math.ceil(count / BATCH));
}

/** The texture of quads of one context, and the vertices of a batch. */
export class QuadTexture {
  private texture: WebGLTexture | null = null;
  private rows = 0;
  private readonly array: WebGLVertexArrayObject;
  private readonly indices: WebGLBuffer;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.array = gl.createVertexArray() as WebGLVertexArrayObject;
    this.indices = gl.createBuffer() as WebGLBuffer;
    const corners = Uint16Array.from({ length: CORNERS.length * BATCH }, (_, i) => {
      return 4 * Math.floor(i / CORNERS.length) + (CORNERS[i % CORNERS.length] as number);
    });
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.indices);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
  }

  /** Most splats that the context can hold. */
  get most(): number {
    return ROW * (this.gl.getParameter(this.gl.MAX_TEXTURE_SIZE) as number);
  }

  /** Uploads the first `count` splats of an array of `floatsOfQuads` floats that `endQuads` has ended. */
  upload(quads: Float32Array<ArrayBuffer>, count: number): void {
    const { gl } = this;
    const rows = Math.ceil(count / ROW);
    gl.activeTexture(gl.TEXTURE0 + UNIT);
    if (rows > this.rows) this.make(quads.length / (FLOATS * ROW));
    if (rows === 0) return;
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    // A host may have set these otherwise.
    gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, null);
    gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, false);
    gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
    gl.pixelStorei(gl.UNPACK_ROW_LENGTH, 0);
    gl.pixelStorei(gl.UNPACK_SKIP_PIXELS, 0);
    gl.pixelStorei(gl.UNPACK_SKIP_ROWS, 0);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, WIDTH, rows, gl.RGBA, gl.FLOAT, quads);
  }

  /** Draws `count` splats with the current program, whose sampler `QuadTexels` is 0. */
  draw(count: number): void {
    if (count === 0) return;
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + UNIT);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.bindVertexArray(this.array);
    gl.drawElementsInstanced(gl.TRIANGLES, CORNERS.length * BATCH, gl.UNSIGNED_SHORT, 0, Math.ceil(count / BATCH));
    gl.bindVertexArray(null);
  }

  dispose(): void {
    this.gl.deleteTexture(this.texture);
    this.gl.deleteVertexArray(this.array);
    this.gl.deleteBuffer(this.indices);
  }

  private make(rows: number): void {
    const { gl } = this;
    gl.deleteTexture(this.texture);
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, WIDTH, rows);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    this.rows = rows;
  }
}
