// Copy of avatar_shaders/hlsl/bind_triangles.hlsl, by `python -m avatar_shaders`; do not edit.
// Stage `bind` for binding surface, first step, one thread a triangle: its turn, its sizes and its corners.
// Reads: SurfaceStatic, Mesh. Writes: Triangles.
#include "platform_core.hlsl"
#include "packed_core.hlsl"
#include "bind_core.hlsl"

StructuredBuffer<uint> SurfaceStatic; // sections at the offsets below
StructuredBuffer<float4> Mesh; // [3 or 5 vertices]: positions are read
RWStructuredBuffer<float4> Triangles; // [3 triangles]: edge x edge, size; quaternion wxyz; size at rest, vertex ids

AVATAR_PACKED(surface, SurfaceStatic)

AVATAR_CONSTANTS(BindTrianglesConstants)
    uint triangles;
    uint vertices;
    uint corners; // 3 planes of vertex ids, an element a triangle
    uint corners_width; // bits of an element
    uint canonical; // 3 planes of positions in the binding pose, an element a vertex
    uint canonical_width;
    uint canonical_scale; // low and step of each axis
    uint rotation_rule; // AVATAR_ROTATION_*
    uint quaternion_sign; // AVATAR_QUATERNION_SIGN_*
AVATAR_CONSTANTS_END

uint corner(uint plane, uint row)
{
    return surface_code(corners, plane * triangles + row, corners_width);
}

float3 canonical_position(uint vertex)
{
    return surface_linear3(canonical, vertex, vertices, canonical_width, canonical_scale);
}

[numthreads(AVATAR_THREADS, 1, 1)]
void bind_triangles(uint3 id : SV_DispatchThreadID)
{
    uint row = id.x;
    if (row >= triangles)
    {
        return;
    }
    uint v0 = corner(0, row), v1 = corner(1, row), v2 = corner(2, row);
    float3 p0 = Mesh[v0].xyz, p1 = Mesh[v1].xyz, p2 = Mesh[v2].xyz;
    float3 c0 = canonical_position(v0), c1 = canonical_position(v1), c2 = canonical_position(v2);
    TriangleShape shape, rest;
    float4 turn;
    if (rotation_rule == AVATAR_ROTATION_TRIANGLE_FRAME)
    {
        shape = triangle_by_edge(p0, p1, p2);
        rest = triangle_by_edge(c0, c1, c2);
        turn = quat_from_matrix(shape.frame);
    }
    else
    {
        shape = triangle_by_area(p0, p1, p2);
        rest = triangle_by_area(c0, c1, c2);
        turn = triangle_turn(shape.frame, rest.frame, quaternion_sign);
    }
    Triangles[row] = float4(shape.across, shape.size);
    Triangles[triangles + row] = turn;
    Triangles[2 * triangles + row] = float4(rest.size, (float)v0, (float)v1, (float)v2);
}
