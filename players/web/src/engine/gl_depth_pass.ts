// Writes the depth of splats into a host's framebuffer.

import { DEPTH_GLSL } from "../made/depth.js";
import { linked } from "../webgl2/draw.js";
import type { QuadTexture } from "../webgl2/quads.js";

const UNIT = 0; // uniform block

/** Draws quads once more, without colour. */
export class GlDepthPass {
  private readonly program: WebGLProgram;
  private readonly buffer: WebGLBuffer;
  private readonly constants = new Float32Array(4); // RasterDepthConstants: width, height, flip_y, depth_alpha

  constructor(private readonly gl: WebGL2RenderingContext, alpha: number) {
    this.program = linked(gl, "raster_vertex_batch", "raster_depth_pixel", UNIT, DEPTH_GLSL);
    this.buffer = gl.createBuffer() as WebGLBuffer;
    this.constants[3] = alpha;
  }

  /** Draws `count` quads into what is bound; depth test and viewport are the caller's. */
  draw(quads: QuadTexture, count: number, width: number, height: number, flipY: number): void {
    const { gl, constants } = this;
    constants[0] = width;
    constants[1] = height;
    constants[2] = flipY;
    gl.bindBufferBase(gl.UNIFORM_BUFFER, UNIT, this.buffer);
    gl.bufferData(gl.UNIFORM_BUFFER, constants, gl.DYNAMIC_DRAW);
    gl.useProgram(this.program);
    gl.disable(gl.BLEND);
    gl.disable(gl.CULL_FACE);
    gl.disable(gl.STENCIL_TEST);
    gl.colorMask(false, false, false, false);
    gl.depthMask(true);
    quads.draw(count);
  }

  dispose(): void {
    this.gl.deleteProgram(this.program);
    this.gl.deleteBuffer(this.buffer);
  }
}
