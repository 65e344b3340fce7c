// Asking the browser for a GPU.

import { AvatarError } from "../errors.js";
import { Shared } from "../shared.js";

const WANTED_LIMITS = ["maxBufferSize", "maxStorageBufferBindingSize", "maxTextureDimension2D"] as const;
export const FLOAT_BLEND = "float32-blendable";

/** The device of all players of a page; null where this browser has no WebGPU. */
export const DEVICE: Shared<Promise<GPUDevice | null>> = new Shared(
  () => {
    const asked = requestDevice();
    void asked.then((device) => device?.lost.then(() => DEVICE.forget(asked)));
    return asked;
  },
  (asked) => void asked.then((device) => device?.destroy()),
);

/** A device with the adapter's own limits for buffers; null where this browser has no WebGPU. */
async function requestDevice(): Promise<GPUDevice | null> {
  const gpu = typeof navigator === "undefined" ? undefined : navigator.gpu;
  const adapter = await gpu?.requestAdapter({ powerPreference: "high-performance" }).catch(() => null);
  if (!adapter) return null;
  const requiredLimits: Record<string, number> = {};
  for (const name of WANTED_LIMITS) requiredLimits[name] = adapter.limits[name];
  const features = [FLOAT_BLEND].filter((name) => adapter.features.has(name)) as GPUFeatureName[];
  return adapter.requestDevice({ requiredLimits, requiredFeatures: features }).catch(() => null);
}

/** Throws AvatarError if the device takes no buffer of that size. */
export function checkBufferSize(device: GPUDevice, bytes: number, what: string, owner?: string): void {
  const most = Math.min(device.limits.maxBufferSize, device.limits.maxStorageBufferBindingSize);
  if (bytes > most) {
    throw new AvatarError(
      `${what} takes ${bytes} bytes; this GPU takes ${most} in one buffer. Use a coarser level of detail.`,
      { owner, field: "WebGPU" },
    );
  }
}
