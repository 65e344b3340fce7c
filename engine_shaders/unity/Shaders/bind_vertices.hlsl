// Copy of avatar_shaders/hlsl/bind_vertices.hlsl, by `python -m avatar_shaders`; do not edit.
// Stage `bind` for binding surface, second step, one thread a vertex: normal and quaternion of its triangles.
// Reads: SurfaceStatic, Triangles. Writes: Mesh.
#include "platform_core.hlsl"
#include "bind_core.hlsl"

StructuredBuffer<uint> SurfaceStatic; // sections at the offsets below
StructuredBuffer<float4> Triangles; // [2 triangles]: edge x edge and size; quaternion wxyz
RWStructuredBuffer<float4> Mesh; // [3 vertices]: normals and quaternions are written

AVATAR_CONSTANTS(BindVerticesConstants)
    uint vertices;
    uint triangles;
    uint canonical_size; // a float a triangle
    uint vertex_triangle_ptr; // vertices + 1
    uint vertex_triangle; // triangles around a vertex, increasing
    float normal_floor; // bundle units squared
    float quaternion_floor; // bundle units squared
    uint quaternion_by_area; // 1: rotation rule vertex_quaternion_mean; 0: vertex_quaternion
AVATAR_CONSTANTS_END

[numthreads(AVATAR_THREADS, 1, 1)]
void bind_vertices(uint3 id : SV_DispatchThreadID)
{
    uint row = id.x;
    if (row >= vertices)
    {
        return;
    }
    float3 across = float3(0, 0, 0);
    float4 turn = float4(0, 0, 0, 0);
    float area = 0;
    uint end = SurfaceStatic[vertex_triangle_ptr + row + 1];
    for (uint e = SurfaceStatic[vertex_triangle_ptr + row]; e < end; ++e)
    {
        uint t = SurfaceStatic[vertex_triangle + e];
        across += Triangles[t].xyz;
        turn += asfloat(SurfaceStatic[canonical_size + t]) * Triangles[triangles + t];
        area += asfloat(SurfaceStatic[canonical_size + t]);
    }
    Mesh[vertices + row] = float4(vertex_normal(across, normal_floor), 0);
    if (quaternion_by_area != 0)
    {
        Mesh[2 * vertices + row] = vertex_quat_mean(turn, area);
    }
    else
    {
        Mesh[2 * vertices + row] = vertex_quat(turn, quaternion_floor);
    }
}
