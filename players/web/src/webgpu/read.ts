// Reads images and buffers back: for tests, screenshots and conformance.

const MAP_READ = 0x1, COPY_DST = 0x8; // GPUBufferUsage
const READ = 0x1; // GPUMapMode
const ROW = 256; // bytes: rows of a copied texture begin at multiples of it

/** The content of a buffer. */
export async function readBuffer(device: GPUDevice, buffer: GPUBuffer): Promise<ArrayBuffer> {
  const copy = device.createBuffer({ size: buffer.size, usage: MAP_READ | COPY_DST });
  const encoder = device.createCommandEncoder();
  encoder.copyBufferToBuffer(buffer, 0, copy, 0, buffer.size);
  device.queue.submit([encoder.finish()]);
  return mapped(copy);
}

/** A float image as [H, W, 4]. */
export async function readImage(device: GPUDevice, image: GPUTexture): Promise<Float32Array> {
  const { width, height } = image;
  const half = image.format === "rgba16float";
  const bytes = (half ? 8 : 16) * width;
  const bytesPerRow = Math.ceil(bytes / ROW) * ROW;
  const copy = device.createBuffer({ size: bytesPerRow * height, usage: MAP_READ | COPY_DST });
  const encoder = device.createCommandEncoder();
  encoder.copyTextureToBuffer({ texture: image }, { buffer: copy, bytesPerRow }, [width, height]);
  device.queue.submit([encoder.finish()]);
  const raw = await mapped(copy);
  const result = new Float32Array(4 * width * height);
  for (let y = 0; y < height; y++) {
    if (half) {
      const row = new Uint16Array(raw, y * bytesPerRow, 4 * width);
      for (let i = 0; i < row.length; i++) result[4 * width * y + i] = floatOfHalf(row[i] as number);
    } else {
      result.set(new Float32Array(raw, y * bytesPerRow, 4 * width), 4 * width * y);
    }
  }
  return result;
}

async function mapped(copy: GPUBuffer): Promise<ArrayBuffer> {
  await copy.mapAsync(READ);
  const content = copy.getMappedRange().slice(0);
  copy.destroy();
  return content;
}

/** The number that 16 bits of a half float stand for. */
export function floatOfHalf(bits: number): number {
  const sign = bits & 0x8000 ? -1 : 1;
  const exponent = (bits >> 10) & 31;
  const fraction = bits & 1023;
  if (exponent === 0) return sign * fraction * 2 ** -24;
  if (exponent === 31) return fraction === 0 ? sign * Infinity : NaN;
  return sign * (1 + fraction / 1024) * 2 ** (exponent - 15);
}
