// Stage `bind` for binding surface, first step, one thread a triangle: its turn and its size.
// Reads: SurfaceStatic, Mesh. Writes: Triangles.
#include "platform.hlsli"
#include "bind.hlsli"

StructuredBuffer<uint> SurfaceStatic; // sections at the offsets below
StructuredBuffer<float4> Mesh; // [3 or 5 vertices]: positions are read
RWStructuredBuffer<float4> Triangles; // [2 triangles]: edge x edge and size; quaternion wxyz

AVATAR_CONSTANTS(BindTrianglesConstants)
    uint triangles;
    uint triangle_plane; // 3 planes of vertex ids
    uint canonical_frame; // 9 planes, row-major
    uint rotation_rule; // AVATAR_ROTATION_*
    uint quaternion_sign; // AVATAR_QUATERNION_SIGN_*
AVATAR_CONSTANTS_END

float canonical_axis(uint plane, uint row)
{
    return asfloat(SurfaceStatic[canonical_frame + plane * triangles + row]);
}

Rows3 canonical_rows(uint row)
{
    Rows3 m;
    m.row0 = float3(canonical_axis(0, row), canonical_axis(1, row), canonical_axis(2, row));
    m.row1 = float3(canonical_axis(3, row), canonical_axis(4, row), canonical_axis(5, row));
    m.row2 = float3(canonical_axis(6, row), canonical_axis(7, row), canonical_axis(8, row));
    return m;
}

float3 corner(uint plane, uint row)
{
    return Mesh[SurfaceStatic[triangle_plane + plane * triangles + row]].xyz;
}

[numthreads(AVATAR_THREADS, 1, 1)]
void bind_triangles(uint3 id : SV_DispatchThreadID)
{
    uint row = id.x;
    if (row >= triangles)
    {
        return;
    }
    float3 p0 = corner(0, row), p1 = corner(1, row), p2 = corner(2, row);
    TriangleShape shape;
    float4 turn;
    if (rotation_rule == AVATAR_ROTATION_TRIANGLE_FRAME)
    {
        shape = triangle_by_edge(p0, p1, p2);
        turn = quat_from_matrix(shape.frame);
    }
    else
    {
        shape = triangle_by_area(p0, p1, p2);
        turn = triangle_turn(shape.frame, canonical_rows(row), quaternion_sign);
    }
    Triangles[row] = float4(shape.across, shape.size);
    Triangles[triangles + row] = turn;
}
