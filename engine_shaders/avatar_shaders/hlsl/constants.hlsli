// Render constants. Generated from avatar_schema/v1/constants.json by `python -m avatar_shaders`; do not edit.
// Reads: nothing. Writes: nothing.
#ifndef AVATAR_CONSTANTS_HLSLI
#define AVATAR_CONSTANTS_HLSLI

// pixels squared added to both variances of the projected covariance, so that no splat is thinner than about a pixel [diff-gaussian-rasterization 59f5f77 forward.cu:111]
#define AVATAR_LOW_PASS 0.3f
// floor of mid^2 - det under the square root of the larger eigenvalue; a round splat gets sqrt(0.1) more than its variance [diff-gaussian-rasterization 59f5f77 forward.cu:229]
#define AVATAR_EIGENVALUE_FLOOR 0.1f
// the trainer touches the tiles of this many standard deviations; it culls tiles, never pixels [diff-gaussian-rasterization 59f5f77 forward.cu:231]
#define AVATAR_RADIUS_SIGMAS 3.0f
// view z at or below this (in training units) is not drawn [diff-gaussian-rasterization 59f5f77 auxiliary.h:154]
#define AVATAR_NEAR 0.2f
// x/z and y/z are clamped to this times tan(fov/2) in the Jacobian, not in the centre [diff-gaussian-rasterization 59f5f77 forward.cu:83]
#define AVATAR_FRUSTUM_CLAMP 1.3f
// added to clip w before its reciprocal [diff-gaussian-rasterization 59f5f77 forward.cu:199]
#define AVATAR_HOMOGENEOUS_EPSILON 1e-07f
// alpha of one splat at one pixel never exceeds this [diff-gaussian-rasterization 59f5f77 forward.cu:345]
#define AVATAR_ALPHA_MAX 0.99f
// alpha below 1 / this is skipped (the division is done in float32) [diff-gaussian-rasterization 59f5f77 forward.cu:346]
#define AVATAR_ALPHA_MIN_DENOMINATOR 255.0f
// the splat that would bring the transmittance below this is not added and ends the pixel (trainer profile) [diff-gaussian-rasterization 59f5f77 forward.cu:349]
#define AVATAR_TRANSMITTANCE_MIN 0.0001f
// pixels along the side of a tile [diff-gaussian-rasterization 59f5f77 config.h]
#define AVATAR_TILE 16
// Newton steps R <- (R + R^-T) / 2 of the polar factor; 1e-14 away at 30 degrees, 1e-9 at 60 [GaussianBlendshapes 2952da7 transforms.py:28]
#define AVATAR_POLAR_STEPS 3
// real spherical harmonics, band 0 [diff-gaussian-rasterization 59f5f77 auxiliary.h:22]
#define AVATAR_SH_C0_0 0.28209479177387814f
// band 1 with its signs, factors of y, z, x [diff-gaussian-rasterization 59f5f77 auxiliary.h:23]
#define AVATAR_SH_C1_0 (-0.4886025119029199f)
#define AVATAR_SH_C1_1 0.4886025119029199f
#define AVATAR_SH_C1_2 (-0.4886025119029199f)
// band 2, factors of xy, yz, 2zz-xx-yy, xz, xx-yy [diff-gaussian-rasterization 59f5f77 auxiliary.h:24]
#define AVATAR_SH_C2_0 1.0925484305920792f
#define AVATAR_SH_C2_1 (-1.0925484305920792f)
#define AVATAR_SH_C2_2 0.31539156525252005f
#define AVATAR_SH_C2_3 (-1.0925484305920792f)
#define AVATAR_SH_C2_4 0.5462742152960396f
// band 3, factors of y(3xx-yy), xyz, y(4zz-xx-yy), z(2zz-3xx-3yy), x(4zz-xx-yy), z(xx-yy), x(xx-3yy) [diff-gaussian-rasterization 59f5f77 auxiliary.h:31]
#define AVATAR_SH_C3_0 (-0.5900435899266435f)
#define AVATAR_SH_C3_1 2.890611442640554f
#define AVATAR_SH_C3_2 (-0.4570457994644658f)
#define AVATAR_SH_C3_3 0.3731763325901154f
#define AVATAR_SH_C3_4 (-0.4570457994644658f)
#define AVATAR_SH_C3_5 1.445305721320277f
#define AVATAR_SH_C3_6 (-0.5900435899266435f)
// least length, an area in training units squared, by which a summed vertex normal is divided [SplattingAvatar 3847314: pytorch3d Meshes.verts_normals_packed]
#define AVATAR_NORMAL_FLOOR 1e-06f
// least length, an area in training units squared, by which a summed vertex quaternion is divided [SplattingAvatar 3847314 splatting_avatar_model.py: normalize(..., eps=1e-6)]
#define AVATAR_QUATERNION_FLOOR 1e-06f
// training units squared, added to both areas of the ratio that scales a Gaussian; it dominates on meshes in metres [SplattingAvatar 3847314 splatting_avatar_model.py]
#define AVATAR_AREA_DAMPING 0.0001f
// the light of the capture is taken to be at least this, so that what was dark in it does not turn to noise [this format: SPEC.md, section 19]
#define AVATAR_LIGHT_FLOOR 0.05f
// bundle units; a point light is taken to be at least this far away [this format: SPEC.md, section 19]
#define AVATAR_LIGHT_NEAREST 0.01f
// texels along an edge of a shadow map [this format: SPEC.md, section 19]
#define AVATAR_SHADOW_SIZE 256
// a Gaussian casts a shadow where its alpha, seen from the light, is at least this [this format: SPEC.md, section 19]
#define AVATAR_SHADOW_ALPHA 0.3f
// texels squared, added to both variances of a Gaussian in a shadow map, so that none is thinner than a texel [this format: SPEC.md, section 19]
#define AVATAR_SHADOW_LOW_PASS 0.25f

#endif
