// Opens the visitor's camera, or says in one sentence why it cannot.

import { AvatarError } from "../errors.js";

const WANTED = { video: { facingMode: "user", width: { ideal: 640 }, height: { ideal: 480 }, frameRate: { ideal: 30 } }, audio: false };
const IN_FRAME = ' A page inside an iframe also needs the attribute allow="camera" on that iframe.';

/** The pictures of a camera. Throws AvatarError. */
export async function openCamera(): Promise<MediaStream> {
  if (!isSecureContext) throw new AvatarError("A browser gives the camera to pages from https or localhost alone; open this page there.");
  const devices = navigator.mediaDevices as MediaDevices | undefined;
  if (devices?.getUserMedia === undefined) throw new AvatarError("This browser gives no camera to pages.");
  try {
    return await devices.getUserMedia(WANTED);
  } catch (error) {
    throw new AvatarError(why(error instanceof Error ? error.name : "", String(error)));
  }
}

function why(name: string, text: string): string {
  switch (name) {
    case "NotAllowedError":
    case "SecurityError":
      return refused();
    case "NotFoundError":
    case "OverconstrainedError":
      return "No camera was found; connect one, and try again.";
    case "NotReadableError":
    case "AbortError":
      return "The camera cannot be read; another program may use it: close that, and try again.";
    default:
      return `The camera cannot be opened (${text}).`;
  }
}

function refused(): string {
  const policy = (document as { featurePolicy?: { allowsFeature(name: string): boolean } }).featurePolicy;
  const framed = window.self !== window.top;
  if (framed && policy?.allowsFeature("camera") === false) {
    return 'This page lies in an iframe that may not use the camera; its page must write allow="camera" on it.';
  }
  return `The camera was not allowed; allow it for this page in the browser's settings.${framed ? IN_FRAME : ""}`;
}
