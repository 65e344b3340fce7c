// The lights of a PlayCanvas layer, in its units: a white matt surface that faces a light reflects its linear colour.

import { Color, LIGHTFALLOFF_LINEAR, LIGHTTYPE_DIRECTIONAL, LIGHTTYPE_SPOT, Vec3, type AppBase, type GraphNode } from "playcanvas";
import { AvatarError } from "../errors.js";
import { smooth, type Falloff, type SceneLights } from "../engine/lights.js";

/** What we read of a light of PlayCanvas besides its public names: its colour times its intensity, linear. */
interface Light {
  readonly _colorLinear: Float32Array;
  readonly _node: GraphNode | null;
  readonly type: number;
  readonly enabled: boolean;
  readonly castShadows: boolean;
  readonly attenuationEnd: number;
  readonly falloffMode: number;
  readonly innerConeAngle: number; // degrees
  readonly outerConeAngle: number;
}

const DEGREES = Math.PI / 180;
const COLOUR = new Color();
const UP = new Vec3();

/** How lights of PlayCanvas fall off: `kind` is the falloff mode. */
export const FALLOFF: Falloff = {
  distance(distance, range, kind) {
    if (kind === LIGHTFALLOFF_LINEAR) return Math.max(0, (range - distance) / range);
    return (16 / (distance * distance + 1)) * Math.max(0, 1 - (distance / range) ** 4) ** 2;
  },
  cone: smooth,
};

/** The ambient colour of the scene, and the lights of a layer. */
export function collect(lights: SceneLights, { scene }: AppBase, layer: number): void {
  COLOUR.linear(scene.ambientLight);
  if (COLOUR.r + COLOUR.g + COLOUR.b > 0) lights.even(COLOUR, scene.physicalUnits ? scene.ambientLuminance : 1);
  const found = (scene.layers.getLayerById(layer) as unknown as { _lights?: readonly Light[] } | null)?._lights;
  if (found === undefined) throw unknown();
  for (let i = 0; i < found.length; i++) add(lights, found[i] as Light);
}

function add(lights: SceneLights, light: Light): void {
  const { _node: node, _colorLinear: colour } = light;
  if (!light.enabled || node === null) return;
  if (colour === undefined) throw unknown();
  COLOUR.r = colour[0] as number;
  COLOUR.g = colour[1] as number;
  COLOUR.b = colour[2] as number;
  const matrix = node.getWorldTransform();
  matrix.getY(UP); // a light shines down
  if (light.type === LIGHTTYPE_DIRECTIONAL) lights.direct(UP, COLOUR, 1, light.castShadows);
  else lights.point(node.getPosition(), COLOUR, 1, light.castShadows, light.attenuationEnd, light.falloffMode);
  if (light.type === LIGHTTYPE_SPOT) lights.spot(UP, Math.cos(light.outerConeAngle * DEGREES), Math.cos(light.innerConeAngle * DEGREES));
}

function unknown(): AvatarError {
  return new AvatarError("the lights of a layer are not where they were in release 2.23; use that one, or `lights: false`", { owner: "PlayCanvas" });
}
