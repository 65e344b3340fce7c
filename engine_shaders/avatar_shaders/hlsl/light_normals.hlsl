// Stage `light`, first step where joints turn the Gaussians (bary_vertex_lbs), one thread a Gaussian: its normal, which
// turns with its triangle. Expressions bend a mesh that joints alone do not.
// Reads: EmbedStatic, LightStatic, Triangles. Writes: Splats.
#include "platform.hlsli"
#include "packed.hlsli"
#include "splat.hlsli"

StructuredBuffer<uint> EmbedStatic; // sections at the offsets below
StructuredBuffer<uint> LightStatic; // sections at the offsets below
StructuredBuffer<float4> Triangles; // [3 triangles]: edge x edge, size; quaternion wxyz; size at rest, vertex ids
RWStructuredBuffer<float4> Splats; // [6 count]: what other entries know, then the normal in the world

AVATAR_PACKED(embed, EmbedStatic)
AVATAR_PACKED(light, LightStatic)

AVATAR_CONSTANTS(LightNormalsConstants)
    float4 world_quat_wxyz; // world from avatar
    uint count;
    uint triangles;
    uint triangle_ids; // a triangle a Gaussian
    uint triangle_ids_width;
    uint local_quat; // 4 planes, wxyz
    uint local_quat_width;
    uint local_quat_scale;
    uint normal; // 3 planes, in the axes of the Gaussian
    uint normal_width;
    uint normal_scale;
AVATAR_CONSTANTS_END

[numthreads(AVATAR_THREADS, 1, 1)]
void light_normals(uint3 id : SV_DispatchThreadID)
{
    uint row = id.x;
    if (row >= count)
    {
        return;
    }
    float4 turn = Triangles[triangles + embed_code(triangle_ids, row, triangle_ids_width)];
    float4 own = float4(
        embed_linear(local_quat, row, local_quat_width, local_quat_scale),
        embed_linear3(local_quat, count + row, count, local_quat_width, local_quat_scale + 2));
    float3 n = light_linear3(normal, row, count, normal_width, normal_scale);
    n = rotate(matrix_from_quat(own / max(length(own), 1e-12)), n);
    n = rotate(matrix_from_quat(world_quat_wxyz), rotate(matrix_from_quat(turn), n));
    Splats[5 * count + row] = float4(n, 0);
}
