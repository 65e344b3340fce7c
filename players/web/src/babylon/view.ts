import type { Scene } from "@babylonjs/core/scene.js";
import type { EngineView } from "../engine/view.js";

/** Takes the active camera of a scene and what its engine draws into now. */
export function setView(view: EngineView, scene: Scene, firstRow: "top" | "bottom"): void {
  const engine = scene.getEngine();
  const width = engine.getRenderWidth();
  const height = engine.getRenderHeight();
  const part = scene.activeCamera?.viewport;
  const x = Math.floor((part?.x ?? 0) * width), w = Math.floor((part?.width ?? 1) * width);
  const y = Math.floor((part?.y ?? 0) * height), h = Math.floor((part?.height ?? 1) * height);
  view.setViewport(x, firstRow === "bottom" ? y : height - y - h, w, h);
  // Materials write what is displayed, unless a post-process makes it so.
  view.linear = scene.imageProcessingConfiguration.applyByPostProcess;
  view.reversed = engine.useReverseDepthBuffer;
  const range = engine.isNDCHalfZRange ? "zero_to_one" : "minus_one_to_one";
  view.setCamera(scene.getViewMatrix().m, scene.getProjectionMatrix().m, range, firstRow, width, height);
}
