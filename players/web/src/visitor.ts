export { AvatarError } from "./errors.js";
export { liveLinkCsv } from "./pose/live_link_writer.js";
export { type Addresses, type Seen, TRACKER_FILES } from "./visitor/messages.js";
export { FaceRecorder } from "./visitor/recorder.js";
export { NOT_SEEN, SEEN_BADLY } from "./visitor/seen.js";
export type { Files } from "./visitor/tracker.js";
export { Visitor, type VisitorOptions } from "./visitor/visitor.js";
