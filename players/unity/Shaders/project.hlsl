// Copy of avatar_shaders/hlsl/project.hlsl, by `python -m avatar_shaders`; do not edit.
// Stage `project`, one thread a Gaussian: the splat on the screen, and its colour in direction sh_rotation^T d.
// Reads: Splats, Sh. Writes: Projected.
#include "platform_core.hlsl"
#include "project_core.hlsl"

StructuredBuffer<float4> Splats; // [5 count]: mean and opacity; quaternion; 3 rows of sh_rotation with scale in w
StructuredBuffer<float> Sh; // [3 terms, count]: plane 3 k + channel
RWStructuredBuffer<float4> Projected; // [3 count]: centre, depth, opacity; conic, radius; rgb, clip depth

AVATAR_CONSTANTS(ProjectConstants)
    uint count;
    uint sh_degree; // the active one
    float near_z;
    float low_pass;
    float4 camera_row0; // camera from world
    float4 camera_row1;
    float4 camera_row2;
    float4 clip_row0; // clip from world
    float4 clip_row1;
    float4 clip_row2;
    float4 clip_row3;
    float4 eye; // world
    float2 tan_half_fov;
    float2 image_size; // pixels
AVATAR_CONSTANTS_END

float3 sh_coefficient(uint k, uint row)
{
    uint at = 3 * k * count + row;
    return float3(Sh[at], Sh[at + count], Sh[at + 2 * count]);
}

float3 splat_colour(float3 d, uint row)
{
    float3 colour = sh_band0(sh_coefficient(0, row));
    if (sh_degree > 0)
    {
        colour += sh_band1(d, sh_coefficient(1, row), sh_coefficient(2, row), sh_coefficient(3, row));
    }
    if (sh_degree > 1)
    {
        colour += sh_band2(
            d, sh_coefficient(4, row), sh_coefficient(5, row), sh_coefficient(6, row), sh_coefficient(7, row),
            sh_coefficient(8, row));
    }
    if (sh_degree > 2)
    {
        colour += sh_band3(
            d, sh_coefficient(9, row), sh_coefficient(10, row), sh_coefficient(11, row), sh_coefficient(12, row),
            sh_coefficient(13, row), sh_coefficient(14, row), sh_coefficient(15, row));
    }
    return max(colour + 0.5, 0.0);
}

SplatCamera project_camera()
{
    SplatCamera camera;
    camera.camera_from_world.row0 = camera_row0;
    camera.camera_from_world.row1 = camera_row1;
    camera.camera_from_world.row2 = camera_row2;
    camera.clip_x = clip_row0;
    camera.clip_y = clip_row1;
    camera.clip_z = clip_row2;
    camera.clip_w = clip_row3;
    camera.tan_half_fov = tan_half_fov;
    camera.size = image_size;
    camera.low_pass = low_pass;
    camera.near_z = near_z;
    return camera;
}

[numthreads(AVATAR_THREADS, 1, 1)]
void project(uint3 id : SV_DispatchThreadID)
{
    uint row = id.x;
    if (row >= count)
    {
        return;
    }
    float4 mean = Splats[row];
    float4 row0 = Splats[2 * count + row], row1 = Splats[3 * count + row], row2 = Splats[4 * count + row];
    SeenSplat seen = project_splat(
        mean.xyz, float3(row0.w, row1.w, row2.w), Splats[count + row], project_camera());
    if (!(seen.radius > 0))
    {
        Projected[row] = float4(0, 0, 0, 0);
        Projected[count + row] = float4(0, 0, 0, 0);
        Projected[2 * count + row] = float4(0, 0, 0, 0);
        return;
    }
    Rows3 sh_rotation;
    sh_rotation.row0 = row0.xyz;
    sh_rotation.row1 = row1.xyz;
    sh_rotation.row2 = row2.xyz;
    float3 towards = mean.xyz - eye.xyz;
    float3 d = rotate_inverse(sh_rotation, towards / length(towards));
    Projected[row] = float4(seen.centre, seen.depth, mean.w);
    Projected[count + row] = float4(seen.conic, seen.radius);
    Projected[2 * count + row] = float4(splat_colour(d, row), seen.clip_depth);
}
