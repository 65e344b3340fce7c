// Copy of avatar_shaders/hlsl/bind_vertices.hlsl, by `python -m avatar_shaders`; do not edit.
// Stage `bind` for binding surface, second step, one thread a vertex: the normal and the turn of the mesh.
// Reads: SurfaceStatic, Triangles, Pose. Writes: Mesh.
#include "platform_core.hlsl"
#include "packed_core.hlsl"
#include "bind_core.hlsl"

StructuredBuffer<uint> SurfaceStatic; // sections at the offsets below
StructuredBuffer<float4> Triangles; // [3 triangles]: edge x edge, size; quaternion wxyz; size at rest, vertex ids
StructuredBuffer<float> Pose; // for rotation rule bary_vertex_lbs
RWStructuredBuffer<float4> Mesh; // [3 or 5 vertices]: normals and turns are written

AVATAR_PACKED(surface, SurfaceStatic)

AVATAR_CONSTANTS(BindVerticesConstants)
    uint vertices;
    uint triangles;
    uint vertex_triangle_ptr; // vertices + 1, width 32
    uint vertex_triangle; // triangles around a vertex, increasing
    uint vertex_triangle_width; // bits of an element
    float normal_floor; // bundle units squared
    float quaternion_floor; // bundle units squared
    uint rotation_rule; // AVATAR_ROTATION_*
    uint skin_ptr; // vertices + 1, width 32
    uint skin_column; // a joint an entry
    uint skin_column_width;
    uint skin_weight; // 1 an entry
    uint skin_weight_width;
    uint skin_weight_step; // one float
    uint joints; // in Pose, 12 floats a joint: rows of mesh from binding mesh
AVATAR_CONSTANTS_END

Rows4 vertex_joint(uint joint)
{
    uint at = joints + 12 * joint;
    Rows4 m;
    m.row0 = float4(Pose[at], Pose[at + 1], Pose[at + 2], Pose[at + 3]);
    m.row1 = float4(Pose[at + 4], Pose[at + 5], Pose[at + 6], Pose[at + 7]);
    m.row2 = float4(Pose[at + 8], Pose[at + 9], Pose[at + 10], Pose[at + 11]);
    return m;
}

Rows4 vertex_skin_matrix(uint row)
{
    Rows4 blended = skin_none();
    uint end = SurfaceStatic[skin_ptr + row + 1];
    for (uint e = SurfaceStatic[skin_ptr + row]; e < end; ++e)
    {
        float weight = surface_weight(skin_weight, e, skin_weight_width, skin_weight_step);
        blended = skin_add(blended, weight, vertex_joint(surface_code(skin_column, e, skin_column_width)));
    }
    return blended;
}

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
        uint t = surface_code(vertex_triangle, e, vertex_triangle_width);
        float canonical_size = Triangles[2 * triangles + t].x;
        across += Triangles[t].xyz;
        turn += canonical_size * Triangles[triangles + t];
        area += canonical_size;
    }
    Mesh[vertices + row] = float4(vertex_normal(across, normal_floor), 0);
    if (rotation_rule == AVATAR_ROTATION_BARY_VERTEX_LBS)
    {
        Rows4 blended = vertex_skin_matrix(row);
        Mesh[2 * vertices + row] = blended.row0;
        Mesh[3 * vertices + row] = blended.row1;
        Mesh[4 * vertices + row] = blended.row2;
    }
    else if (rotation_rule == AVATAR_ROTATION_VERTEX_QUATERNION_MEAN)
    {
        Mesh[2 * vertices + row] = vertex_quat_mean(turn, area);
    }
    else
    {
        Mesh[2 * vertices + row] = vertex_quat(turn, quaternion_floor);
    }
}
