// Avatars in the WebGL2 context of a host.

import type { Avatar } from "../avatar.js";
import { Instance } from "../instance.js";
import { GlDraw } from "../webgl2/draw.js";
import { kernelModule } from "../webgl2/kernel_module.js";
import { LocalPort } from "../webgl2/local_port.js";
import { QuadSource, type QuadPort } from "../webgl2/quad_source.js";
import { openPort } from "../webgl2/scene_port.js";
import { GlDepth } from "./gl_depth.js";
import { GlDepthPass } from "./gl_depth_pass.js";
import { GlState } from "./gl_state.js";
import { depthAlphaOf, type AvatarHost, type AvatarSceneOptions } from "./host.js";
import { EngineView } from "./view.js";

// For rig_mesh.ts: if it imported them by itself, the scripts of the tag would be cut into more, which compress worse.
export { Poser } from "../pose/poser.js";
export { copied } from "../uniforms.js";
export { KernelScene, kernelProgram } from "../webgl2/kernel_scene.js";
export { kernelModule };

const BLOCKS = 2; // uniform blocks that GlDraw binds
const UPWARDS = -1; // row 0 of the target is at the bottom of OpenGL's clip space

/**
 * Draws avatars into what the host has bound, against its depth, and leaves the context as it was. Splats are blended
 * in a float image of their own, that is put over the host's target once. Where the depth of the target cannot be
 * copied, splats are drawn into the target itself with its depth test: then 8 bit targets round at every splat, and
 * targets of linear light blend colours that are not. Where the host restores a lost context, avatars are drawn again.
 */
export class GlScene<Seen> implements AvatarHost<Seen> {
  readonly lost: Promise<string>;
  private readonly source: QuadSource;
  private drawing: GlDraw | null = null; // null: the context is lost
  private depth: GlDepth;
  private depthPass: GlDepthPass | null = null; // null: no depth is written
  private state: GlState;
  private uploaded = false; // the context has the newest quads
  private readonly view = new EngineView();

  /**
   * `look` writes what a camera sees, and what is bound, into a view. `onUpdate` is called when there is a newer picture
   * than the one shown. Throws AvatarError where the context cannot draw into floats, and as `depthAlphaOf` and
   * `openPort` do.
   */
  static async create<Seen>(
    gl: WebGL2RenderingContext,
    look: (view: EngineView, seen: Seen) => void,
    options: AvatarSceneOptions,
    onUpdate: () => void,
  ): Promise<GlScene<Seen>> {
    const depthAlpha = depthAlphaOf(options);
    const synchronous = options.synchronous ?? false;
    const port: QuadPort = synchronous ? new LocalPort(await kernelModule()) : await openPort();
    try {
      return new GlScene(gl, look, port, depthAlpha, synchronous ? () => undefined : onUpdate, onUpdate);
    } catch (error) {
      port.terminate();
      throw error;
    }
  }

  private constructor(
    private readonly gl: WebGL2RenderingContext,
    private readonly look: (view: EngineView, seen: Seen) => void,
    port: QuadPort,
    private readonly depthAlpha: number | null,
    onQuads: () => void,
    onRestored: () => void,
  ) {
    this.state = new GlState(gl, BLOCKS);
    this.depth = new GlDepth(gl);
    this.drawing = this.made();
    this.source = new QuadSource(port);
    this.lost = this.source.lost;
    this.source.most = this.drawing.most;
    this.source.onQuads = () => {
      this.upload();
      onQuads();
    };
    this.onRestored = () => {
      this.restore();
      onRestored();
    };
    gl.canvas.addEventListener("webglcontextlost", this.onLost);
    gl.canvas.addEventListener("webglcontextrestored", this.onRestored);
  }

  /** Throws AvatarError if there is no such level. */
  add(avatar: Avatar, level: number): Instance {
    const instance = new Instance(avatar, this.source, level);
    this.source.add(instance);
    return instance;
  }

  /** Resolves when the quads of the last picture are here. */
  finished(): Promise<void> {
    return this.source.finished();
  }

  /** Draws into the bound framebuffer. */
  draw(seen: Seen): void {
    const { drawing, state, view } = this;
    this.look(view, seen);
    if (drawing === null) return;
    this.source.frameIfChanged(view.camera);
    if (!this.uploaded || this.source.count === 0) return;
    state.save();
    state.prepare();
    this.drawQuads(drawing, view);
    state.restore();
  }

  dispose(): void {
    this.gl.canvas.removeEventListener("webglcontextlost", this.onLost);
    this.gl.canvas.removeEventListener("webglcontextrestored", this.onRestored);
    this.source.dispose();
    this.drawing?.dispose();
    this.depth.dispose();
    this.depthPass?.dispose();
  }

  /** The kernels and what they hold are not of the context. */
  private readonly onLost = (): void => {
    this.drawing = null;
    this.uploaded = false;
  };

  private readonly onRestored: () => void;

  /** A context that the host restores has nothing of ours. The next picture asks for its quads. */
  private restore(): void {
    this.state = new GlState(this.gl, BLOCKS);
    this.depth = new GlDepth(this.gl);
    this.drawing = this.made();
    this.source.forget();
  }

  private made(): GlDraw {
    this.state.save();
    try {
      const drawing = new GlDraw(this.gl, null);
      if (this.depthAlpha !== null) this.depthPass = new GlDepthPass(this.gl, this.depthAlpha);
      return drawing;
    } finally {
      this.state.restore();
    }
  }

  private upload(): void {
    if (this.drawing === null) return;
    this.state.save();
    this.drawing.upload(this.source.quads, this.source.count);
    this.state.restore();
    this.uploaded = true;
  }

  /** The quads may be of a target of another size, until newer ones come. */
  private drawQuads(drawing: GlDraw, view: EngineView): void {
    const { state } = this;
    const { width, height } = view.camera;
    drawing.begin(width, height);
    const depth = this.depth.copy(state.target, drawing.image, width, height);
    if (depth === "failed") this.drawDirectly(drawing, view);
    else this.drawApart(drawing, view, depth === "copied");
    if (depth !== "none") this.writeDepth(drawing, view);
  }

  private drawApart(drawing: GlDraw, view: EngineView, hidden: boolean): void {
    const { gl, state } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, drawing.image);
    if (hidden) this.testDepth(view);
    this.drawAll(drawing);
    gl.bindFramebuffer(gl.FRAMEBUFFER, state.target);
    gl.viewport(0, 0, view.camera.width, view.camera.height);
    gl.disable(gl.DEPTH_TEST);
    this.limit(view);
    drawing.compose(null, view.linear, false);
  }

  private drawDirectly(drawing: GlDraw, view: EngineView): void {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.state.target);
    this.testDepth(view);
    this.limit(view);
    this.drawAll(drawing);
  }

  private drawAll(drawing: GlDraw): void {
    const { count, width, height } = this.source;
    this.gl.viewport(0, 0, width, height);
    drawing.drawQuads(count, width, height, UPWARDS);
  }

  /** The host's target is bound, and limited. */
  private writeDepth(drawing: GlDraw, view: EngineView): void {
    const { gl, depthPass } = this;
    const { count, width, height } = this.source;
    if (depthPass === null) return;
    this.testDepth(view);
    gl.viewport(0, 0, width, height);
    depthPass.draw(drawing.quads, count, width, height, UPWARDS);
  }

  private testDepth(view: EngineView): void {
    const { gl } = this;
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(view.reversed ? gl.GEQUAL : gl.LEQUAL);
  }

  /** Draws only where the host does: in its viewport and its scissor. */
  private limit(view: EngineView): void {
    const { gl, state } = this;
    if (!view.partial && !state.scissored) return;
    const { viewport } = view;
    const x = viewport[0] as number, y = viewport[1] as number, w = viewport[2] as number, h = viewport[3] as number;
    const box = state.scissor;
    gl.enable(gl.SCISSOR_TEST);
    if (!state.scissored) {
      gl.scissor(x, y, w, h);
      return;
    }
    const left = Math.max(x, box[0] as number), bottom = Math.max(y, box[1] as number);
    const right = Math.min(x + w, (box[0] as number) + (box[2] as number));
    const top = Math.min(y + h, (box[1] as number) + (box[3] as number));
    gl.scissor(left, bottom, Math.max(right - left, 0), Math.max(top - bottom, 0));
  }
}
