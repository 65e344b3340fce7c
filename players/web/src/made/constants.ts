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
/** real spherical harmonics, band 0 */
export const SH_C0: readonly number[] = [0.28209479177387814];
/** band 1 with its signs, factors of y, z, x */
export const SH_C1: readonly number[] = [-0.4886025119029199, 0.4886025119029199, -0.4886025119029199];
/** band 2, factors of xy, yz, 2zz-xx-yy, xz, xx-yy */
export const SH_C2: readonly number[] = [1.0925484305920792, -1.0925484305920792, 0.31539156525252005, -1.0925484305920792, 0.5462742152960396];
/** band 3, factors of y(3xx-yy), xyz, y(4zz-xx-yy), z(2zz-3xx-3yy), x(4zz-xx-yy), z(xx-yy), x(xx-3yy) */
export const SH_C3: readonly number[] = [-0.5900435899266435, 2.890611442640554, -0.4570457994644658, 0.3731763325901154, -0.4570457994644658, 1.445305721320277, -0.5900435899266435];
/** least length, an area in training units squared, by which a summed vertex normal is divided */
export const NORMAL_FLOOR = 1e-06;
/** least length, an area in training units squared, by which a summed vertex quaternion is divided */
export const QUATERNION_FLOOR = 1e-06;
/** training units squared, added to both areas of the ratio that scales a Gaussian; it dominates on meshes in metres */
export const AREA_DAMPING = 0.0001;
/** the light of the capture is taken to be at least this, so that what was dark in it does not turn to noise */
export const LIGHT_FLOOR = 0.05;
/** bundle units; a point light is taken to be at least this far away */
export const LIGHT_NEAREST = 0.01;
/** texels along an edge of a shadow map */
export const SHADOW_SIZE = 256;
/** a Gaussian casts a shadow where its alpha, seen from the light, is at least this */
export const SHADOW_ALPHA = 0.3;
/** texels squared, added to both variances of a Gaussian in a shadow map, so that none is thinner than a texel */
export const SHADOW_LOW_PASS = 0.25;
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
