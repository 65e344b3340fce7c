// The lights of a Babylon.js scene, in the units of PBRMaterial: a white matt surface reflects light over pi.

import type { HemisphericLight } from "@babylonjs/core/Lights/hemisphericLight.js";
import type { Light } from "@babylonjs/core/Lights/light.js";
import type { ShadowLight } from "@babylonjs/core/Lights/shadowLight.js";
import type { SpotLight } from "@babylonjs/core/Lights/spotLight.js";
import type { Scene } from "@babylonjs/core/scene.js";
import type { Falloff, SceneLights } from "../engine/lights.js";

const LAMBERT = 1 / Math.PI;
const POINT = 0, DIRECTIONAL = 1, SPOT = 2, HEMISPHERIC = 3; // Light.getTypeID
const TO = { x: 0, y: 0, z: 0 };
const EDGE = 6.64385618977; // log2 of 100: what is left at the edge of a cone, as pbrDirectLightingFalloffFunctions has it

/** How lights fall off on a PBRMaterial: physically, without a range. */
export const FALLOFF: Falloff = {
  distance: (distance) => 1 / (distance * distance),
  cone: (cosine, outer) => 2 ** ((EDGE / (1 - outer)) * (cosine - 1)),
};

/** Lights that are given meshes of their own do not reach avatars. */
export function collect(lights: SceneLights, scene: Scene): void {
  if (!scene.lightsEnabled) return;
  for (let i = 0; i < scene.lights.length; i++) {
    const light = scene.lights[i] as Light;
    if (light.isEnabled() && light.includedOnlyMeshes.length === 0) add(lights, light, light.getTypeID(), light.getScaledIntensity());
  }
}

function add(lights: SceneLights, light: Light, type: number, scale: number): void {
  if (type === HEMISPHERIC) {
    const { direction, diffuse, groundColor } = light as HemisphericLight;
    const length = direction.length();
    TO.x = direction.x / length;
    TO.y = direction.y / length;
    TO.z = direction.z / length;
    lights.hemisphere(TO, diffuse, groundColor, scale); // which PBRMaterial takes as reflected
    return;
  }
  if (type !== POINT && type !== DIRECTIONAL && type !== SPOT) return;
  const moved = light as ShadowLight;
  const inParent = moved.computeTransformedInformation();
  if (type !== POINT) {
    const { x, y, z } = inParent ? moved.transformedDirection : moved.direction;
    TO.x = -x;
    TO.y = -y;
    TO.z = -z;
  }
  const casts = light.shadowEnabled && light.getShadowGenerator() !== null;
  if (type === DIRECTIONAL) lights.direct(TO, light.diffuse, LAMBERT * scale, casts);
  else lights.point(inParent ? moved.transformedPosition : moved.position, light.diffuse, LAMBERT * scale, casts, 0, 0);
  if (type === SPOT) lights.spot(TO, Math.cos((light as SpotLight).angle / 2), 1);
}
