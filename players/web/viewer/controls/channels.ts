// What a person can move, as data: one channel a slider, in groups. The panel draws them and knows nothing else.
import { ARKIT_NAMES, Driver, drivingFrame, type Avatar, type DrivingFrame, type Pose } from "../../src/index.js";

const DEGREES = 180 / Math.PI;
const MOST_DEGREES = 150; // packs have no limits of joints; beyond this no joint looks right
const SMALLEST_GROUP = 2;

/** One number that a slider shows and sets. */
export interface Channel {
  readonly label: string;
  readonly low: number;
  readonly high: number;
  readonly step: number;
  readonly unit: string; // "" or "°"
  read(): number;
  write(value: number): void;
}

/** Channels under one title. `make` is called once, when the group is first opened or searched. */
export interface ChannelGroup {
  readonly title: string;
  readonly words: string; // what a search looks through, lower case
  readonly make: () => readonly Channel[];
}

/** A part of the panel. */
export interface ChannelSection {
  readonly title: string;
  readonly groups: readonly ChannelGroup[];
  /** Sets its channels to rest. */
  reset(): void;
}

/** A step of 1, 2 or 5 times a power of ten, about a hundredth of the range. */
export function niceStep(low: number, high: number): number {
  const rough = (high - low) / 100;
  const power = 10 ** Math.floor(Math.log10(rough));
  const digit = rough / power;
  return power * (digit < 1.5 ? 1 : digit < 3.5 ? 2 : digit < 7.5 ? 5 : 10);
}

/** "mouthSmileLeft" belongs to "mouth", "exp_003" to "exp". */
function family(name: string): string {
  return /^[a-z]+|^[A-Z]+[a-z]*|^[A-Za-z]+/.exec(name)?.[0]?.toLowerCase() ?? "";
}

/** Channels by the first word of their names; families of one come last, together. */
function grouped(channels: readonly Channel[]): ChannelGroup[] {
  const families = new Map<string, Channel[]>();
  for (const channel of channels) {
    const key = family(channel.label);
    families.set(key, [...(families.get(key) ?? []), channel]);
  }
  const rest: Channel[] = [];
  const groups: ChannelGroup[] = [];
  for (const [title, members] of families) {
    if (members.length < SMALLEST_GROUP || title === "") rest.push(...members);
    else groups.push(groupOf(title, members));
  }
  if (rest.length > 0) groups.push(groupOf(groups.length > 0 ? "other" : "all", rest));
  return groups;
}

function groupOf(title: string, channels: readonly Channel[]): ChannelGroup {
  const words = channels.map((channel) => channel.label.toLowerCase()).join(" ");
  return { title, words, make: () => channels };
}

/** Sliders for the expressions and eyelids of `pose`, over their trained ranges. */
export function expressionSection(avatar: Avatar, pose: Pose): ChannelSection | null {
  const weights = pose.expressionWeights;
  const channels = avatar.expressions.map((expression, i) =>
    weightChannel(expression.name, expression.range[0], expression.range[1], weights, i),
  );
  const late = avatar.eyelids.map((name, i) => weightChannel(name, 0, 1, pose.lateWeights, i));
  if (channels.length + late.length === 0) return null;
  const groups = grouped(channels);
  if (late.length > 0) groups.push(groupOf("eyelids", late));
  return {
    title: "Expressions",
    groups,
    reset() {
      for (const channel of [...channels, ...late]) channel.write(0);
    },
  };
}

function weightChannel(label: string, low: number, high: number, weights: Float32Array, index: number): Channel {
  return {
    label,
    low,
    high: high > low ? high : low + 1,
    step: niceStep(low, high > low ? high : low + 1),
    unit: "",
    read: () => weights[index] ?? 0,
    write: (value) => {
      weights[index] = value;
    },
  };
}

/** Sliders for the rotation vector of each joint, in degrees. */
export function jointSection(avatar: Avatar, pose: Pose): ChannelSection | null {
  const names = avatar.skeleton?.names ?? [];
  if (names.length === 0) return null;
  return {
    title: "Joints",
    groups: names.map((name) => ({
      title: name,
      words: name.toLowerCase(),
      make: () => jointChannels(name, pose),
    })),
    reset() {
      for (const name of names) pose.setJoint(name, 0, 0, 0);
    },
  };
}

function jointChannels(name: string, pose: Pose): Channel[] {
  const vector = new Float64Array(3); // radians
  return ["x", "y", "z"].map((axis, i) => ({
    label: axis,
    low: -MOST_DEGREES,
    high: MOST_DEGREES,
    step: 1,
    unit: "°",
    read() {
      pose.readJoint(name, vector);
      return vector[i]! * DEGREES;
    },
    write(value: number) {
      pose.readJoint(name, vector);
      vector[i] = value / DEGREES;
      pose.setJoint(name, vector[0]!, vector[1]!, vector[2]!);
    },
  }));
}

/** The state of the ARKit sliders: what the avatar's driving turns into a pose. */
export class ArkitInputs {
  readonly frame = drivingFrame();

  constructor(
    private readonly driver: Driver,
    private readonly pose: Pose,
  ) {}

  /** Drives the pose by what the sliders say. */
  apply(): void {
    this.driver.pose(this.frame, this.pose);
  }

  /** Takes over a frame that came from elsewhere, so that the sliders show it. */
  take(frame: DrivingFrame): void {
    this.frame.weights.set(frame.weights);
    this.frame.head.set(frame.head);
    this.frame.leftEye.set(frame.leftEye);
    this.frame.rightEye.set(frame.rightEye);
  }

  /** All inputs to rest, without driving. */
  clear(): void {
    this.frame.weights.fill(0);
    this.frame.head.fill(0);
    this.frame.leftEye.fill(0);
    this.frame.rightEye.fill(0);
  }
}

/** The 52 ARKit sliders and the measured rotations, where the avatar has a driving. */
export function arkitSection(avatar: Avatar, inputs: ArkitInputs | null): ChannelSection | null {
  if (avatar.driving === null || inputs === null) return null;
  const { frame } = inputs;
  const channels = ARKIT_NAMES.map((name, i): Channel => ({
    ...weightChannel(name, 0, 1, frame.weights, i),
    write(value) {
      frame.weights[i] = value;
      inputs.apply();
    },
  }));
  const groups = grouped(channels);
  const { headJoint, leftEyeJoint, rightEyeJoint } = avatar.driving;
  if (headJoint !== null || avatar.driving.outputs.length > 0) groups.push(turnGroup("head turn", frame.head, inputs));
  if (leftEyeJoint !== null) groups.push(turnGroup("left eye turn", frame.leftEye, inputs));
  if (rightEyeJoint !== null) groups.push(turnGroup("right eye turn", frame.rightEye, inputs));
  return {
    title: "ARKit",
    groups,
    reset() {
      inputs.clear();
      inputs.apply();
    },
  };
}

function turnGroup(title: string, angles: Float64Array, inputs: ArkitInputs): ChannelGroup {
  const names = ["yaw", "pitch", "roll"];
  return {
    title,
    words: `${title} ${names.join(" ")}`,
    make: () =>
      names.map((label, i) => ({
        label,
        low: -60,
        high: 60,
        step: 1,
        unit: "°",
        read: () => angles[i]! * DEGREES,
        write(value: number) {
          angles[i] = value / DEGREES;
          inputs.apply();
        },
      })),
  };
}
