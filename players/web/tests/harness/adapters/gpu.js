// WebGPU without presenting: a GPU process that draws with the CPU may end when a page presents.

import { SIZE, clamped, makeCanvas } from "./stage.js";

/** Collects what a WebGPU device complains about; gives it away when called. */
export function watchErrors(device) {
  const found = [];
  device?.addEventListener("uncapturederror", (event) => found.push(event.error.message.slice(0, 600)));
  void device?.lost.then((info) => found.push(`device lost: ${info.message}`));
  return async () => {
    await device?.queue.onSubmittedWorkDone();
    return found.splice(0);
  };
}

/** A canvas whose WebGPU context is a texture that stays. */
export class QuietCanvas {
  element = makeCanvas();
  texture = null;
  configuration = null;

  constructor() {
    const context = {
      canvas: this.element,
      configure: (configuration) => this.configure(configuration),
      unconfigure: () => undefined,
      getConfiguration: () => this.configuration,
      getCurrentTexture: () => this.texture,
    };
    const real = this.element.getContext.bind(this.element);
    this.element.getContext = (kind, options) => (kind === "webgpu" ? context : real(kind, options));
  }

  /** RGBA bytes, first row on top. */
  async read() {
    const { device, format } = this.configuration;
    const bytesPerRow = 4 * SIZE;
    const buffer = device.createBuffer({ size: bytesPerRow * SIZE, usage: GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ });
    const encoder = device.createCommandEncoder();
    encoder.copyTextureToBuffer({ texture: this.texture }, { buffer, bytesPerRow }, [SIZE, SIZE]);
    device.queue.submit([encoder.finish()]);
    await buffer.mapAsync(GPUMapMode.READ);
    const bytes = [...new Uint8Array(buffer.getMappedRange())];
    buffer.destroy();
    const swapped = format.startsWith("bgra");
    return clamped(bytes.map((value, i) => (swapped && i % 2 === 0 && i % 4 < 3 ? bytes[i ^ 2] : value)));
  }

  configure(configuration) {
    this.configuration = configuration;
    this.texture?.destroy();
    const usage = GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.COPY_SRC | GPUTextureUsage.COPY_DST | GPUTextureUsage.TEXTURE_BINDING;
    const { device, format, viewFormats } = configuration;
    this.texture = device.createTexture({ size: [SIZE, SIZE], format, usage, viewFormats: viewFormats ?? [] });
  }
}
