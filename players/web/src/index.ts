export type {
  Avatar,
  ClipData,
  Driving,
  Expression,
  Framing,
  Group,
  LevelInfo,
  Relight,
  Skeleton,
} from "./avatar.js";
export { Camera } from "./camera.js";
export { AvatarError } from "./errors.js";
export type { Progress } from "./fetch.js";
export { levelFor, nextLevel } from "./level.js";
export { idle } from "./life/idle.js";
export { Life } from "./life/life.js";
export { Look } from "./life/look.js";
export type { DirectLight, Light } from "./light/light.js";
export { load, type LoadOptions, type Source } from "./load.js";
export { ARKIT_NAMES, CHANNELS, type DrivingFrame, drivingFrame, setChannels } from "./pose/arkit.js";
export { Clip } from "./pose/clip.js";
export { Driver, type DriverOptions } from "./pose/driver.js";
export { parseLiveLinkCsv } from "./pose/live_link_csv.js";
export { Pose } from "./pose/pose.js";
export { Instance } from "./instance.js";
export { Player, type Canvas, type PlayerOptions } from "./player.js";
export type { Background } from "./renderer.js";
export { type Posed, Poser } from "./pose/poser.js";
export { Recording } from "./pose/recording.js";
export { isWeightsJson, parseWeightsJson } from "./pose/weights_json.js";
