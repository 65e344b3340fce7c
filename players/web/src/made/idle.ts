// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.
/** seconds of a slot with one blink or one pair: 13 a minute */
export const BLINK_EVERY_S = 4.5;
/** part of a slot, from its begin, in which the blink may start: 2 to 7 s apart */
export const BLINK_WINDOW = 0.55;
/** seconds in which the lids fall */
export const BLINK_CLOSE_S = 0.09;
/** seconds of closed eyes; longer than a frame of a film at 25 frames a second, which thus shows them closed */
export const BLINK_CLOSED_S = 0.045;
/** seconds in which the lids rise, fast at first */
export const BLINK_OPEN_S = 0.18;
/** how often a second blink follows at once */
export const BLINK_PAIR_CHANCE = 0.12;
/** seconds from the begin of the first to that of the second */
export const BLINK_PAIR_S = 0.36;
/** a blink starts with the largest gaze shift of its window if that has more degrees */
export const BLINK_WITH_GAZE_DEG = 3.0;
/** mean seconds of a fixation */
export const FIXATION_EVERY_S = 1.7;
/** part of that in which the gaze may shift: fixations of 0.4 to 3 s */
export const FIXATION_WINDOW = 0.75;
/** how many fixations are on the viewer */
export const GAZE_VIEWER_CHANCE = 0.68;
/** how far these lie from straight ahead at most, yaw and pitch, degrees: over a face */
export const GAZE_VIEWER_DEG: readonly number[] = [1.1, 0.7];
/** how far the others lie at most; their yaw is at least 0.4 of it. Within 8 degrees */
export const GAZE_AWAY_DEG: readonly number[] = [6.9, 4.0];
/** seconds of the least gaze shift */
export const SACCADE_S = 0.021;
/** and for each degree more */
export const SACCADE_S_PER_DEG = 0.0022;
/** the head's part of a gaze shift; the eyes then turn back, so that the gaze rests */
export const HEAD_SHARE = 0.3;
/** seconds by which the head starts later than the eyes */
export const HEAD_DELAY_S = 0.04;
/** seconds in which it turns, with least jerk */
export const HEAD_TURN_S = 0.95;
/** seconds of a breath: 14 a minute */
export const BREATH_EVERY_S = 4.285714285714286;
/** part of a breath that flows in */
export const BREATH_IN = 0.4;
/** part that flows out; the rest is a pause */
export const BREATH_OUT = 0.48;
/** breaths come this part of a breath early or late at most; knots of that drift, seconds */
export const BREATH_DRIFT: readonly number[] = [0.3, 9.0];
/** what full lungs add: channels, degrees or weight; the jaw stays, since it parts the lips */
export const BREATH: readonly (readonly [channel: string, row: number, ...numbers: number[]])[] = [
  ["headPitch", 0, 0.8],
  ["noseSneerLeft", 1, 0.06],
  ["noseSneerRight", 1, 0.06],
  ["mouthShrugLower", 2, 0.04],
  ["browInnerUp", 3, 0.02],
];
/** channels on random curves: seconds between knots; size in degrees to both sides, or half the greatest weight */
export const WANDER: readonly (readonly [channel: string, row: number, ...numbers: number[]])[] = [
  ["headYaw", 0, 5.3, 2.2],
  ["headYaw", 1, 1.6, 0.5],
  ["headPitch", 2, 4.7, 1.3],
  ["headPitch", 3, 1.4, 0.4],
  ["headRoll", 4, 4.1, 1.9],
  ["headRoll", 5, 1.9, 0.4],
  ["mouthSmileLeft", 6, 4.3, 0.06],
  ["mouthSmileRight", 6, 4.3, 0.06],
  ["mouthSmileLeft", 7, 2.9, 0.02],
  ["mouthSmileRight", 8, 3.1, 0.02],
  ["mouthPressLeft", 9, 2.7, 0.05],
  ["mouthPressRight", 9, 2.7, 0.05],
  ["browInnerUp", 10, 3.1, 0.06],
  ["browOuterUpLeft", 11, 3.7, 0.04],
  ["browOuterUpRight", 11, 3.7, 0.04],
  ["browDownLeft", 12, 2.3, 0.03],
  ["browDownRight", 12, 2.3, 0.03],
  ["eyeSquintLeft", 13, 3.9, 0.05],
  ["eyeSquintRight", 13, 3.9, 0.05],
];
/** the same of the eyes: fixations drift */
export const GAZE_WANDER: readonly number[] = [0.31, 0.22];
