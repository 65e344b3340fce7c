// Copy of avatar_shaders/hlsl/bind_surface.hlsl, by `python -m avatar_shaders`; do not edit.
// Stage `bind` for binding surface, last step, one thread a Gaussian: it moves with its triangle.
// Reads: EmbedStatic, Mesh, Triangles. Writes: Splats.
#include "platform_core.hlsl"
#include "bind_core.hlsl"

StructuredBuffer<uint> EmbedStatic; // sections at the offsets below
StructuredBuffer<float4> Mesh; // [3 or 5 vertices]: positions; normals; quaternions wxyz, or 3 rows of skin matrices
StructuredBuffer<float4> Triangles; // [2 triangles]: edge x edge and size; quaternion wxyz
RWStructuredBuffer<float4> Splats; // [5 count]: mean and opacity; quaternion; 3 rows of sh_rotation with scale in w

AVATAR_CONSTANTS(BindSurfaceConstants)
    uint count;
    uint vertices;
    uint triangles;
    uint triangle_ids; // a triangle a Gaussian
    uint vertex_ids; // 3 planes
    uint barycentric; // 3 planes
    uint displacement; // a float a Gaussian, position rules normal and interpolated_normal
    uint local_offset; // 3 planes, position rule triangle_frame
    uint local_quat; // 4 planes, wxyz
    uint canonical_size; // a float a Gaussian: of its triangle in the binding pose
    uint position_rule; // AVATAR_POSITION_*
    uint rotation_rule; // AVATAR_ROTATION_*
    uint scale_rule; // AVATAR_SCALE_*
    uint sh_direction; // AVATAR_SH_DIRECTION_*
    float area_damping; // bundle units squared
    float log_training_per_bundle;
    float4 world_row0; // world from avatar, rigid
    float4 world_row1;
    float4 world_row2;
    float4 world_quat_wxyz;
AVATAR_CONSTANTS_END

float embed_value(uint section, uint plane, uint row)
{
    return asfloat(EmbedStatic[section + plane * count + row]);
}

uint embed_vertex(uint corner, uint row)
{
    return EmbedStatic[vertex_ids + corner * count + row];
}

float4 mesh_blend(uint plane, uint row, float3 weight)
{
    uint first = plane * vertices;
    return weight.x * Mesh[first + embed_vertex(0, row)]
        + weight.y * Mesh[first + embed_vertex(1, row)]
        + weight.z * Mesh[first + embed_vertex(2, row)];
}

// The turn of the mesh under a Gaussian since the binding pose, of any length.
float4 surface_turn(uint row, uint triangle_id, float3 weight)
{
    if (rotation_rule == AVATAR_ROTATION_TRIANGLE_FRAME)
    {
        return Triangles[triangles + triangle_id];
    }
    if (rotation_rule == AVATAR_ROTATION_BARY_VERTEX_LBS)
    {
        Rows3 blended;
        blended.row0 = mesh_blend(2, row, weight).xyz;
        blended.row1 = mesh_blend(3, row, weight).xyz;
        blended.row2 = mesh_blend(4, row, weight).xyz;
        return quat_from_matrix(polar(blended));
    }
    return mesh_blend(2, row, weight);
}

float3 surface_position(uint row, float3 foot, float3 weight, float size)
{
    if (position_rule == AVATAR_POSITION_TRIANGLE_FRAME)
    {
        uint v0 = embed_vertex(0, row), v1 = embed_vertex(1, row), v2 = embed_vertex(2, row);
        TriangleShape shape = triangle_by_edge(Mesh[v0].xyz, Mesh[v1].xyz, Mesh[v2].xyz);
        float3 offset = float3(
            embed_value(local_offset, 0, row), embed_value(local_offset, 1, row), embed_value(local_offset, 2, row));
        return foot + size * rotate(shape.frame, offset);
    }
    float3 normal = mesh_blend(1, row, weight).xyz;
    if (position_rule == AVATAR_POSITION_NORMAL)
    {
        normal = bind_unit(normal);
    }
    return foot + embed_value(displacement, 0, row) * normal;
}

float3 surface_scale(float3 log_scale, float size, float canonical)
{
    if (scale_rule == AVATAR_SCALE_LOG_AREA)
    {
        return scale_log_area(log_scale, size, canonical, area_damping, log_training_per_bundle);
    }
    if (scale_rule == AVATAR_SCALE_LINEAR_AREA) // and triangle_linear, which has the same code
    {
        return scale_linear(log_scale, size, canonical);
    }
    return log_scale;
}

[numthreads(AVATAR_THREADS, 1, 1)]
void bind_surface(uint3 id : SV_DispatchThreadID)
{
    uint row = id.x;
    if (row >= count)
    {
        return;
    }
    uint t = EmbedStatic[triangle_ids + row];
    float3 weight = float3(
        embed_value(barycentric, 0, row), embed_value(barycentric, 1, row), embed_value(barycentric, 2, row));
    float3 foot = mesh_blend(0, row, weight).xyz;
    float4 turn = surface_turn(row, t, weight);
    float size = Triangles[t].w;
    float4 local_quat_wxyz = float4(
        embed_value(local_quat, 0, row), embed_value(local_quat, 1, row),
        embed_value(local_quat, 2, row), embed_value(local_quat, 3, row));
    BoundSplat b = bind_by_turn(surface_position(row, foot, weight, size), turn, local_quat_wxyz);
    if (sh_direction == AVATAR_SH_DIRECTION_WORLD)
    {
        b.sh_rotation = identity_rows();
    }
    Rows4 world;
    world.row0 = world_row0;
    world.row1 = world_row1;
    world.row2 = world_row2;
    b = bind_place(b, world, world_quat_wxyz);
    float3 log_scale = float3(Splats[2 * count + row].w, Splats[3 * count + row].w, Splats[4 * count + row].w);
    log_scale = surface_scale(log_scale, size, embed_value(canonical_size, 0, row));
    Splats[row] = float4(b.mean, Splats[row].w);
    Splats[count + row] = b.quat_wxyz;
    Splats[2 * count + row] = float4(b.sh_rotation.row0, log_scale.x);
    Splats[3 * count + row] = float4(b.sh_rotation.row1, log_scale.y);
    Splats[4 * count + row] = float4(b.sh_rotation.row2, log_scale.z);
}
