// A recording of ARKit inputs as a motion: the driver turns each moment into a pose.
import type { Recording } from "../../src/index.js";
import type { ArkitInputs } from "../controls/channels.js";
import type { Motion } from "./clips.js";

/** Plays `recording` through the avatar's driving; the ARKit sliders follow. */
export function recordingMotion(name: string, recording: Recording, inputs: ArkitInputs): Motion {
  return {
    name,
    seconds: recording.seconds,
    fps: recording.fps,
    pose(seconds) {
      recording.sample(seconds, inputs.frame);
      inputs.apply();
    },
  };
}
