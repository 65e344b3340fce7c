// Where an eye looks, as driving frames say it.
import { ARKIT_NAMES, type DrivingFrame, RADIANS_PER_EYE_WEIGHT } from "../pose/arkit.js";

const at = (name: string): number => ARKIT_NAMES.indexOf(name);
const TO_THE_LEFT = [at("eyeLookOutLeft"), at("eyeLookInRight")] as const; // the subject's
const TO_THE_RIGHT = [at("eyeLookInLeft"), at("eyeLookOutRight")] as const;
const UP = [at("eyeLookUpLeft"), at("eyeLookUpRight")] as const;
const DOWN = [at("eyeLookDownLeft"), at("eyeLookDownRight")] as const;

/**
 * Turns both eyes alike in the head by angles [2], radians: to the subject's left, and up. As a recorder does, it sets
 * the eyeLook weights, which move lids and painted eyes, and the measured angles, which turn eye joints.
 */
export function setGaze(frame: DrivingFrame, angles: Float64Array): void {
  const left = (angles[0] as number) / RADIANS_PER_EYE_WEIGHT, up = (angles[1] as number) / RADIANS_PER_EYE_WEIGHT;
  for (let eye = 0; eye < 2; eye++) {
    frame.weights[TO_THE_LEFT[eye] as number] = Math.max(left, 0);
    frame.weights[TO_THE_RIGHT[eye] as number] = Math.max(-left, 0);
    frame.weights[UP[eye] as number] = Math.max(up, 0);
    frame.weights[DOWN[eye] as number] = Math.max(-up, 0);
  }
  frame.leftEye[0] = frame.rightEye[0] = -(angles[0] as number); // the channels count to the right and down
  frame.leftEye[1] = frame.rightEye[1] = -(angles[1] as number);
}
