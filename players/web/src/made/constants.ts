// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.
/** pixels squared added to both variances of the projected covariance, so that no splat is thinner than about a pixel */
export const LOW_PASS = 0.3;
/** floor of mid^2 - det under the square root of the larger eigenvalue; a round splat gets sqrt(0.1) more than its variance */
export const EIGENVALUE_FLOOR = 0.1;
/** the trainer touches the tiles of this many standard deviations; it culls tiles, never pixels */
export const RADIUS_SIGMAS = 3.0;
/** view z at or below this (in training units) is not drawn */
export const NEAR = 0.2;
/** x/z and y/z are clamped to this times tan(fov/2) in the Jacobian, not in the centre */
export const FRUSTUM_CLAMP = 1.3;
/** added to clip w before its reciprocal */
export const HOMOGENEOUS_EPSILON = 1e-07;
/** alpha of one splat at one pixel never exceeds this */
export const ALPHA_MAX = 0.99;
/** alpha below 1 / this is skipped (the division is done in float32) */
export const ALPHA_MIN_DENOMINATOR = 255.0;
/** the splat that would bring the transmittance below this is not added and ends the pixel (trainer profile) */
export const TRANSMITTANCE_MIN = 0.0001;
/** pixels along the side of a tile */
export const TILE = 16;
/** Newton steps R <- (R + R^-T) / 2 of the polar factor; 1e-14 away at 30 degrees, 1e-9 at 60 */
export const POLAR_STEPS = 3;
/** least length, an area in training units squared, by which a summed vertex normal is divided */
export const NORMAL_FLOOR = 1e-06;
/** least length, an area in training units squared, by which a summed vertex quaternion is divided */
export const QUATERNION_FLOOR = 1e-06;
/** training units squared, added to both areas of the ratio that scales a Gaussian; it dominates on meshes in metres */
export const AREA_DAMPING = 0.0001;
/** threads of a group */
export const THREADS = 64;
/** values of a digit */
export const SORT_DIGITS = 16;
/** pairs of a thread */
export const SORT_ITEMS = 16;
/** pairs of a block, which a group sorts */
export const SORT_BLOCK = THREADS * SORT_ITEMS;
/** threads of the one group of sort_scan */
export const SORT_SCAN_THREADS = 128;
/** splats an instance of raster_vertex_batch */
export const QUAD_BATCH = 128;
/** splats a row of the texture that raster_vertex_batch reads: three texels each */
export const QUAD_ROW = 512;
