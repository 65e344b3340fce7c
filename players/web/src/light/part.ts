// What `loadLight` loads.

export { LIGHT_WGSL } from "../made/wgsl_light.js";
export { Lighting } from "./lighting.js";
