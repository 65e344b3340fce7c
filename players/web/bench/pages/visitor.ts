// The page of bench/visitor.mjs: follows a camera whose pictures bear their number, and keeps what was seen in each.
import { Visitor } from "../../src/visitor.js";

const BITS = 12;
const CELL = 16; // pixels, as bench/visitor/film.py draws them

/** A picture that was looked at: its number, when it was seen and answered (ms), and the channels. */
interface Row {
  number: number;
  ms: number;
  answeredMs: number;
  seen: string;
  channels: number[];
}

declare global {
  interface Window {
    rows: Row[];
    failed: string;
    follow(fps: number, images: number): Promise<void>;
  }
}

const numbers: number[] = [];
const strip = document.createElement("canvas");
strip.width = BITS * CELL;
strip.height = CELL;
const context = strip.getContext("2d", { willReadFrequently: true }) as CanvasRenderingContext2D;

// A Visitor makes one bitmap of each picture that it looks at; each has one answer, in order.
const make = window.createImageBitmap.bind(window);
window.createImageBitmap = (async (video: HTMLVideoElement) => {
  const picture = await make(video);
  context.drawImage(picture, 0, picture.height - CELL, strip.width, CELL, 0, 0, strip.width, CELL);
  const { data } = context.getImageData(0, CELL / 2, strip.width, 1);
  let number = 0;
  for (let bit = 0; bit < BITS; bit++) if ((data[4 * (bit * CELL + CELL / 2)] as number) > 127) number |= 1 << bit;
  numbers.push(number);
  return picture;
}) as typeof window.createImageBitmap;

/** A canvas that shows f/N.jpg, one after the other, as a camera. */
async function canvasStream(fps: number, images: number): Promise<MediaStream> {
  const pictures = await Promise.all(
    Array.from({ length: images }, async (_, i) => {
      const image = new Image();
      image.src = `f/${i}.jpg`;
      await image.decode();
      return image;
    }),
  );
  const canvas = document.createElement("canvas");
  canvas.width = (pictures[0] as HTMLImageElement).width;
  canvas.height = (pictures[0] as HTMLImageElement).height;
  const target = canvas.getContext("2d") as CanvasRenderingContext2D;
  const begin = performance.now();
  setInterval(() => {
    const at = Math.floor(((performance.now() - begin) / 1000) * fps) % images;
    target.drawImage(pictures[at] as HTMLImageElement, 0, 0);
  }, 500 / fps);
  return canvas.captureStream(fps);
}

const FIRST = 10; // pictures of the film's beginning
let begun = false;

window.rows = [];
window.failed = "";
window.follow = async (fps, images) => {
  await Visitor.start({
    files: "talk/",
    mirror: false,
    ...(images > 0 ? { stream: await canvasStream(fps, images) } : {}),
    onEnd: (error) => {
      window.failed = error.message;
    },
    onFrame: (visitor) => {
      const number = numbers.shift() ?? -1;
      if (!begun && number < FIRST) {
        begun = true; // the film begins again, with a face at rest
        visitor.learn();
      }
      if (!begun) return;
      const { weights, head, leftEye, rightEye } = visitor.frame;
      window.rows.push({
        number,
        ms: visitor.frameMs,
        answeredMs: performance.now(),
        seen: visitor.seen,
        channels: [...weights, ...head, ...leftEye, ...rightEye],
      });
    },
  });
};
