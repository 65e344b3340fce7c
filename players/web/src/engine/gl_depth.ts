// Copies the depth of a host's framebuffer.

/** Draws against depth where the host has some. Formats must be equal for a copy, and WebGL2 hides the host's. */
export class GlDepth {
  private readonly formats: readonly GLenum[];
  private readonly known = new WeakMap<object, number>(); // place in `formats`; NONE or FAILED
  private readonly canvas = {}; // stands for framebuffer null
  private buffer: WebGLRenderbuffer | null = null;
  private image: WebGLFramebuffer | null = null; // that `buffer` is attached to
  private format: GLenum = 0;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.formats = [gl.DEPTH24_STENCIL8, gl.DEPTH_COMPONENT24, gl.DEPTH_COMPONENT16, gl.DEPTH_COMPONENT32F, gl.DEPTH32F_STENCIL8];
  }

  /**
   * Copies the depth of `host` into a buffer of `image`, both of `width` x `height`. "none": the host has no depth;
   * "failed": it has, and no format fits.
   */
  copy(host: WebGLFramebuffer | null, image: WebGLFramebuffer, width: number, height: number): "copied" | "none" | "failed" {
    const { gl } = this;
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, host);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, image);
    const key = host ?? this.canvas;
    let found = this.known.get(key);
    if (found === undefined) {
      found = this.find(host, image, width, height);
      this.known.set(key, found);
    }
    if (found === NONE) return "none";
    if (found === FAILED) return "failed";
    this.blit(this.formats[found] as GLenum, image, width, height);
    return "copied";
  }

  dispose(): void {
    this.gl.deleteRenderbuffer(this.buffer);
  }

  private find(host: WebGLFramebuffer | null, image: WebGLFramebuffer, width: number, height: number): number {
    const { gl, formats } = this;
    const attachment = host === null ? gl.DEPTH : gl.DEPTH_ATTACHMENT;
    const kind = gl.getFramebufferAttachmentParameter(gl.READ_FRAMEBUFFER, attachment, gl.FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE);
    if (kind === gl.NONE) return NONE;
    while (gl.getError() !== gl.NO_ERROR); // of what was done before
    for (let i = 0; i < formats.length; i++) {
      this.blit(formats[i] as GLenum, image, width, height);
      if (gl.getError() === gl.NO_ERROR) return i;
    }
    return FAILED;
  }

  private blit(format: GLenum, image: WebGLFramebuffer, width: number, height: number): void {
    const { gl } = this;
    if (format !== this.format || image !== this.image) {
      gl.deleteRenderbuffer(this.buffer);
      this.buffer = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, this.buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
      gl.framebufferRenderbuffer(gl.DRAW_FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, this.buffer);
      this.format = format;
      this.image = image;
    }
    gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.DEPTH_BUFFER_BIT, gl.NEAREST);
  }
}

const NONE = -1;
const FAILED = -2;
