// The lights of a three.js scene, in its units: a white Lambert surface reflects light over pi (release 155 and later).

import { Vector3, type AmbientLight, type Camera, type DirectionalLight, type HemisphereLight, type LightProbe, type Object3D, type PointLight, type SpotLight } from "three";
import { smooth, type Falloff, type SceneLights } from "../engine/lights.js";

const LAMBERT = 1 / Math.PI;
const PROBE = [1, -2 / 3, 2 / 3, -2 / 3, 1 / 4, -1 / 4, 1 / 4, -1 / 4, 1 / 4] as const; // by the cosine, with the signs of our bases
const AT = new Vector3();
const TO = new Vector3();

/** Lights of three.js by their flags. */
type AnyLight = Object3D &
  Partial<Omit<DirectionalLight & PointLight & SpotLight & HemisphereLight & LightProbe & AmbientLight, keyof Object3D | "shadow">> &
  Pick<AmbientLight, "color" | "intensity">;

/** How lights of three.js fall off: `range` is `distance`, `kind` is `decay`. */
export const FALLOFF: Falloff = {
  distance(distance, range, kind) {
    const falloff = 1 / Math.max(distance ** kind, 0.01);
    return range > 0 ? falloff * Math.max(0, 1 - (distance / range) ** 4) ** 2 : falloff;
  },
  cone: smooth,
};

/** Makes what collects the lights that a camera's picture of a scene has. */
export function collector(): (lights: SceneLights, scene: Object3D, camera: Camera) => void {
  let lights: SceneLights, camera: Camera;
  const take = (object: Object3D): void => {
    if ("isLight" in object && object.layers.test(camera.layers)) add(lights, object as AnyLight);
  };
  return (into, scene, seen) => {
    lights = into;
    camera = seen;
    scene.traverseVisible(take);
  };
}

function add(lights: SceneLights, light: AnyLight): void {
  const scale = LAMBERT * light.intensity;
  AT.setFromMatrixPosition(light.matrixWorld);
  if (light.target !== undefined) TO.subVectors(AT, TO.setFromMatrixPosition(light.target.matrixWorld));
  if (light.isAmbientLight) lights.even(light.color, scale);
  else if (light.isHemisphereLight && light.groundColor) lights.hemisphere(AT.normalize(), light.color, light.groundColor, scale);
  else if (light.isLightProbe && light.sh) addProbe(lights, light as LightProbe);
  else if (light.isDirectionalLight) lights.direct(TO, light.color, scale, light.castShadow);
  else if (light.isPointLight || light.isSpotLight) {
    lights.point(AT, light.color, scale, light.castShadow, light.distance ?? 0, light.decay ?? 2);
    const { angle = 0, penumbra = 0 } = light;
    if (light.isSpotLight) lights.spot(TO, Math.cos(angle), Math.cos(angle * (1 - penumbra)));
  }
}

function addProbe(lights: SceneLights, { sh: { coefficients }, intensity }: LightProbe): void {
  for (let k = 0; k < PROBE.length; k++) {
    const { x, y, z } = coefficients[k] as Vector3;
    lights.term(k, x, y, z, intensity * (PROBE[k] as number));
  }
}
