// Copy of avatar_shaders/hlsl/bind_skin.hlsl, by `python -m avatar_shaders`; do not edit.
// Stage `bind` for bindings skin, anchor, joint_mix and none: one dispatch a group, one thread a Gaussian.
// Reads: BindStatic, Pose. Writes: Splats.
#include "platform_core.hlsl"
#include "packed_core.hlsl"
#include "bind_core.hlsl"

StructuredBuffer<uint> BindStatic; // sections at the offsets below
StructuredBuffer<float> Pose;
RWStructuredBuffer<float4> Splats; // [5 count]: mean and opacity; quaternion; 3 rows of sh_rotation with scale in w

AVATAR_PACKED(bind, BindStatic)

// X_width: bits of an element. X_step: a float a column and axis; skin_weight_step: one float.
AVATAR_CONSTANTS(BindSkinConstants)
    uint count; // Gaussians of the chunk
    uint first; // the group's are first .. first + rows
    uint rows;
    uint corrective_ptr; // count + 1, width 32
    uint corrective_column; // a feature an entry
    uint corrective_column_width;
    uint corrective_mean; // 3 an entry
    uint corrective_mean_width;
    uint corrective_mean_step;
    uint late_ptr; // count + 1, width 32
    uint late_column; // a late morph an entry
    uint late_column_width;
    uint late_mean; // 3 an entry
    uint late_mean_width;
    uint late_mean_step;
    uint skin_ptr; // count + 1, width 32
    uint skin_column; // a joint an entry
    uint skin_column_width;
    uint skin_weight; // 1 an entry
    uint skin_weight_width;
    uint skin_weight_step;
    uint features; // in Pose
    uint late; // in Pose
    uint joints; // in Pose, 12 floats a joint
    uint binding_rule; // AVATAR_BINDING_*: skin takes a matrix a row, others take the group's matrix
    uint rotation_rule; // AVATAR_ROTATION_*: under binding skin, polar3 takes a rotation a row, others the group's
    uint sh_direction; // AVATAR_SH_DIRECTION_*
    uint unused;
    float4 group_matrix_row0; // mesh from binding mesh
    float4 group_matrix_row1;
    float4 group_matrix_row2;
    float4 group_rotation_row0;
    float4 group_rotation_row1;
    float4 group_rotation_row2;
    float4 world_row0; // world from avatar, rigid
    float4 world_row1;
    float4 world_row2;
    float4 world_quat_wxyz;
AVATAR_CONSTANTS_END

float3 bind_corrected(float3 mean, uint row)
{
    uint end = BindStatic[corrective_ptr + row + 1];
    for (uint e = BindStatic[corrective_ptr + row]; e < end; ++e)
    {
        uint column = bind_code(corrective_column, e, corrective_column_width);
        uint step = corrective_mean_step + 3 * column;
        mean += Pose[features + column] * bind_signed3(corrective_mean, 3 * e, corrective_mean_width, step);
    }
    return mean;
}

float3 bind_late(uint row)
{
    float3 sum = float3(0, 0, 0);
    uint end = BindStatic[late_ptr + row + 1];
    for (uint e = BindStatic[late_ptr + row]; e < end; ++e)
    {
        uint column = bind_code(late_column, e, late_column_width);
        float3 delta = bind_signed3(late_mean, 3 * e, late_mean_width, late_mean_step + 3 * column);
        sum = late_add(sum, Pose[late + column], delta);
    }
    return sum;
}

Rows4 bind_skin_matrix(uint row)
{
    Rows4 blended = skin_none();
    uint end = BindStatic[skin_ptr + row + 1];
    for (uint e = BindStatic[skin_ptr + row]; e < end; ++e)
    {
        uint at = joints + 12 * bind_code(skin_column, e, skin_column_width);
        Rows4 m;
        m.row0 = float4(Pose[at], Pose[at + 1], Pose[at + 2], Pose[at + 3]);
        m.row1 = float4(Pose[at + 4], Pose[at + 5], Pose[at + 6], Pose[at + 7]);
        m.row2 = float4(Pose[at + 8], Pose[at + 9], Pose[at + 10], Pose[at + 11]);
        blended = skin_add(blended, bind_weight(skin_weight, e, skin_weight_width, skin_weight_step), m);
    }
    return blended;
}

[numthreads(AVATAR_THREADS, 1, 1)]
void bind_skin(uint3 id : SV_DispatchThreadID)
{
    if (id.x >= rows)
    {
        return;
    }
    uint row = first + id.x;
    Rows4 transform;
    transform.row0 = group_matrix_row0;
    transform.row1 = group_matrix_row1;
    transform.row2 = group_matrix_row2;
    Rows3 rotation;
    rotation.row0 = group_rotation_row0.xyz;
    rotation.row1 = group_rotation_row1.xyz;
    rotation.row2 = group_rotation_row2.xyz;
    if (binding_rule == AVATAR_BINDING_SKIN)
    {
        transform = bind_skin_matrix(row);
        if (rotation_rule == AVATAR_ROTATION_POLAR3)
        {
            rotation = polar(linear_part(transform));
        }
    }
    Rows4 world;
    world.row0 = world_row0;
    world.row1 = world_row1;
    world.row2 = world_row2;
    float4 mean = Splats[row];
    BoundSplat b = bind_by_matrix(
        transform, rotation, bind_corrected(mean.xyz, row), bind_late(row), Splats[count + row]);
    if (sh_direction == AVATAR_SH_DIRECTION_WORLD)
    {
        b.sh_rotation = identity_rows();
    }
    b = bind_place(b, world, world_quat_wxyz);
    Splats[row] = float4(b.mean, mean.w);
    Splats[count + row] = b.quat_wxyz;
    Splats[2 * count + row] = float4(b.sh_rotation.row0, Splats[2 * count + row].w);
    Splats[3 * count + row] = float4(b.sh_rotation.row1, Splats[3 * count + row].w);
    Splats[4 * count + row] = float4(b.sh_rotation.row2, Splats[4 * count + row].w);
}
