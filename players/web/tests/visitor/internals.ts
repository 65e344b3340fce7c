// What the tests of the visitor look at.
export * from "../../src/index.js";
export { liveLinkCsv } from "../../src/pose/live_link_writer.js";
export { LANDMARKS, SCORE_NAMES, STABLE } from "../../src/made/face_map.js";
export { Alignment } from "../../src/visitor/alignment.js";
export { Follower } from "../../src/visitor/follower.js";
export { Neutral } from "../../src/visitor/neutral.js";
export { OneEuro } from "../../src/visitor/one_euro.js";
export { FaceRecorder } from "../../src/visitor/recorder.js";
export { NOT_SEEN, SEEN_BADLY } from "../../src/visitor/seen.js";
