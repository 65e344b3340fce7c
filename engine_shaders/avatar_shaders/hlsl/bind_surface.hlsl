// Stage `bind` for binding surface, last step, one thread a Gaussian: it moves with its triangle.
// Reads: EmbedStatic, Mesh, Triangles. Writes: Splats.
#include "platform.hlsli"
#include "packed.hlsli"
#include "bind.hlsli"

StructuredBuffer<uint> EmbedStatic; // sections at the offsets below
StructuredBuffer<float4> Mesh; // [3 or 5 vertices]: positions; normals; quaternions wxyz, or 3 rows of skin matrices
StructuredBuffer<float4> Triangles; // [3 triangles]: edge x edge, size; quaternion wxyz; size at rest, vertex ids
RWStructuredBuffer<float4> Splats; // [5 count]: mean and opacity; quaternion; 3 rows of sh_rotation with scale in w

AVATAR_PACKED(embed, EmbedStatic)

// X_width: bits of an element. X_scale: low and step of each channel.
AVATAR_CONSTANTS(BindSurfaceConstants)
    uint count;
    uint vertices;
    uint triangles;
    uint triangle_ids; // a triangle a Gaussian
    uint triangle_ids_width;
    uint barycentric; // 3 planes
    uint barycentric_width;
    uint barycentric_scale;
    uint displacement; // 1 plane, position rules normal and interpolated_normal
    uint displacement_width;
    uint displacement_scale;
    uint local_offset; // 3 planes, position rule triangle_frame
    uint local_offset_width;
    uint local_offset_scale;
    uint local_quat; // 4 planes, wxyz
    uint local_quat_width;
    uint local_quat_scale;
    uint position_rule; // AVATAR_POSITION_*
    uint rotation_rule; // AVATAR_ROTATION_*
    uint scale_rule; // AVATAR_SCALE_*
    uint sh_direction; // AVATAR_SH_DIRECTION_*
    uint unused;
    float area_damping; // bundle units squared
    float log_training_per_bundle;
    float4 world_row0; // world from avatar, rigid
    float4 world_row1;
    float4 world_row2;
    float4 world_quat_wxyz;
AVATAR_CONSTANTS_END

// The corners of a Gaussian's triangle, and its weights at them.
struct Foot
{
    uint3 vertex;
    float3 weight;
};

float4 mesh_blend(uint plane, Foot foot)
{
    uint first = plane * vertices;
    return foot.weight.x * Mesh[first + foot.vertex.x]
        + foot.weight.y * Mesh[first + foot.vertex.y]
        + foot.weight.z * Mesh[first + foot.vertex.z];
}

// The turn of the mesh under a Gaussian since the binding pose, of any length.
float4 surface_turn(uint triangle_id, Foot foot)
{
    if (rotation_rule == AVATAR_ROTATION_TRIANGLE_FRAME)
    {
        return Triangles[triangles + triangle_id];
    }
    if (rotation_rule == AVATAR_ROTATION_BARY_VERTEX_LBS)
    {
        Rows3 blended;
        blended.row0 = mesh_blend(2, foot).xyz;
        blended.row1 = mesh_blend(3, foot).xyz;
        blended.row2 = mesh_blend(4, foot).xyz;
        return quat_from_matrix(polar(blended));
    }
    return mesh_blend(2, foot);
}

float3 surface_position(uint row, Foot foot, float size)
{
    float3 moved;
    if (position_rule == AVATAR_POSITION_TRIANGLE_FRAME)
    {
        TriangleShape shape = triangle_by_edge(
            Mesh[foot.vertex.x].xyz, Mesh[foot.vertex.y].xyz, Mesh[foot.vertex.z].xyz);
        float3 offset = embed_linear3(local_offset, row, count, local_offset_width, local_offset_scale);
        moved = size * rotate(shape.frame, offset);
    }
    else
    {
        float3 normal = mesh_blend(1, foot).xyz;
        if (position_rule == AVATAR_POSITION_NORMAL)
        {
            normal = bind_unit(normal);
        }
        moved = embed_linear(displacement, row, displacement_width, displacement_scale) * normal;
    }
    return mesh_blend(0, foot).xyz + moved;
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
    uint t = embed_code(triangle_ids, row, triangle_ids_width);
    float4 rest = Triangles[2 * triangles + t];
    Foot foot;
    foot.vertex = uint3(rest.yzw);
    foot.weight = embed_linear3(barycentric, row, count, barycentric_width, barycentric_scale);
    float4 turn = surface_turn(t, foot);
    float size = Triangles[t].w;
    float4 local_quat_wxyz = float4(
        embed_linear(local_quat, row, local_quat_width, local_quat_scale),
        embed_linear3(local_quat, count + row, count, local_quat_width, local_quat_scale + 2));
    BoundSplat b = bind_by_turn(surface_position(row, foot, size), turn, local_quat_wxyz);
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
    log_scale = surface_scale(log_scale, size, rest.x);
    Splats[row] = float4(b.mean, Splats[row].w);
    Splats[count + row] = b.quat_wxyz;
    Splats[2 * count + row] = float4(b.sh_rotation.row0, log_scale.x);
    Splats[3 * count + row] = float4(b.sh_rotation.row1, log_scale.y);
    Splats[4 * count + row] = float4(b.sh_rotation.row2, log_scale.z);
}
