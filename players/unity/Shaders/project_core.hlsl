// Copy of avatar_shaders/hlsl/project.hlsli, by `python -m avatar_shaders`; do not edit.
// Core of stage `project`: EWA projection of one Gaussian, in the trainer's order of operations.
// Reads: nothing. Writes: nothing.
//
// Camera: +x right, +y down, +z forward; pixel centres at integers. The focal length in pixels is
// width / (2 tan(fov / 2)): a port that takes twice that has a quarter of the trained low-pass.
#ifndef AVATAR_PROJECT_HLSLI
#define AVATAR_PROJECT_HLSLI

#include "splat_core.hlsl"

// Neither infinite nor NaN.
bool is_finite(float x)
{
    return (asuint(x) & 0x7F800000u) != 0x7F800000u;
}

struct SplatCamera
{
    Rows4 camera_from_world;
    float4 clip_x; // rows of clip from world
    float4 clip_y;
    float4 clip_z;
    float4 clip_w;
    float2 tan_half_fov;
    float2 size; // pixels
    float low_pass; // pixels squared
    float near_z; // bundle units
};

struct SeenSplat
{
    float2 centre; // pixels
    float depth; // view z
    float3 conic; // inverse 2D covariance xx, xy, yy
    float radius; // pixels, 3 standard deviations; 0: not drawn
    float clip_depth; // z / w, 0..1
};

float project_form(float3 a, Covariance s, float3 b)
{
    float x = a.x * s.xx + a.y * s.xy + a.z * s.xz;
    float y = a.x * s.xy + a.y * s.yy + a.z * s.yz;
    float z = a.x * s.xz + a.y * s.yz + a.z * s.zz;
    return x * b.x + y * b.y + z * b.z;
}

// xx, xy, yy of J W Sigma W^T J^T plus the low-pass; p in camera space.
float3 projected_covariance(float3 p, Covariance s, SplatCamera camera)
{
    float2 focal = camera.size / (2 * camera.tan_half_fov);
    float2 limit = AVATAR_FRUSTUM_CLAMP * camera.tan_half_fov;
    float2 xy = min(limit, max(-limit, p.xy / p.z)) * p.z;
    float3 w0 = camera.camera_from_world.row0.xyz;
    float3 w1 = camera.camera_from_world.row1.xyz;
    float3 w2 = camera.camera_from_world.row2.xyz;
    float3 t0 = w0 * (focal.x / p.z) + w2 * (-(focal.x * xy.x) / (p.z * p.z));
    float3 t1 = w1 * (focal.y / p.z) + w2 * (-(focal.y * xy.y) / (p.z * p.z));
    return float3(
        project_form(t0, s, t0) + camera.low_pass,
        project_form(t1, s, t0),
        project_form(t1, s, t1) + camera.low_pass);
}

// Whether centre +- extent touches a tile of the image. An extent beyond the integers ends at the border.
bool touches_image(float2 centre, float extent, float2 size)
{
    float2 grid = ceil(size / AVATAR_TILE);
    float2 low = clamp((centre - extent) / AVATAR_TILE, -1e6, 1e6);
    float2 high = clamp((centre + extent + AVATAR_TILE - 1) / AVATAR_TILE, -1e6, 1e6);
    low = clamp(trunc(low), float2(0, 0), grid);
    high = clamp(trunc(high), float2(0, 0), grid);
    return high.x > low.x && high.y > low.y;
}

SeenSplat project_splat(float3 mean, float3 scale, float4 quat_wxyz, SplatCamera camera)
{
    SeenSplat seen;
    float3 p = transform_point(camera.camera_from_world, mean);
    float3 cov = projected_covariance(p, covariance(scale, quat_wxyz), camera);
    float det = cov.x * cov.z - cov.y * cov.y;
    float mid = 0.5 * (cov.x + cov.z);
    float root = sqrt(max(AVATAR_EIGENVALUE_FLOOR, mid * mid - det));
    float radius = ceil(AVATAR_RADIUS_SIGMAS * sqrt(max(mid + root, mid - root)));
    float4 at = float4(mean, 1);
    float reciprocal = 1.0 / (dot(camera.clip_w, at) + AVATAR_HOMOGENEOUS_EPSILON);
    float2 ndc = float2(dot(camera.clip_x, at), dot(camera.clip_y, at)) * reciprocal;
    seen.centre = ndc * (0.5 * camera.size) + (0.5 * camera.size - 0.5);
    seen.depth = p.z;
    seen.conic = float3(cov.z, -cov.y, cov.x) * (1.0 / det);
    // A compiler may assume that there is no NaN when it compares numbers. The test of the bits is exact.
    bool sound = is_finite(det) && abs(det) > 0 && is_finite(radius) && is_finite(seen.centre.x + seen.centre.y);
    bool drawn = sound && p.z > camera.near_z && touches_image(seen.centre, radius, camera.size);
    seen.radius = drawn ? radius : 0;
    seen.clip_depth = saturate(dot(camera.clip_z, at) * reciprocal);
    return seen;
}

#endif
