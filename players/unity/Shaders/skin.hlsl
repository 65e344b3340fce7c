// Copy of avatar_shaders/hlsl/skin.hlsl, by `python -m avatar_shaders`; do not edit.
// Stage `skin`, one thread a vertex: V' = (sum_b W_b A_b) V, then late morphs.
// Reads: SkinStatic, Pose. Writes: Mesh.
#include "platform_core.hlsl"
#include "packed_core.hlsl"
#include "skin_core.hlsl"

StructuredBuffer<uint> SkinStatic; // sections at the offsets below
StructuredBuffer<float> Pose;
RWStructuredBuffer<float4> Mesh; // [3 or 5 vertices]: positions are read and replaced

AVATAR_PACKED(skinned, SkinStatic)

// X_width: bits of an element. late_position_step: a float a late morph and axis. skin_weight_step: one float.
AVATAR_CONSTANTS(SkinConstants)
    uint first; // vertices first .. first + count
    uint count;
    uint late_ptr; // count + 1, width 32
    uint late_column; // a late morph an entry
    uint late_column_width;
    uint late_position; // 3 an entry
    uint late_position_width;
    uint late_position_step;
    uint skin_ptr; // count + 1, width 32
    uint skin_column; // a joint an entry
    uint skin_column_width;
    uint skin_weight; // 1 an entry
    uint skin_weight_width;
    uint skin_weight_step;
    uint late; // in Pose
    uint joints; // in Pose, 12 floats a joint: rows of mesh from binding mesh
AVATAR_CONSTANTS_END

Rows4 skin_joint(uint joint)
{
    uint at = joints + 12 * joint;
    Rows4 m;
    m.row0 = float4(Pose[at], Pose[at + 1], Pose[at + 2], Pose[at + 3]);
    m.row1 = float4(Pose[at + 4], Pose[at + 5], Pose[at + 6], Pose[at + 7]);
    m.row2 = float4(Pose[at + 8], Pose[at + 9], Pose[at + 10], Pose[at + 11]);
    return m;
}

[numthreads(AVATAR_THREADS, 1, 1)]
void skin(uint3 id : SV_DispatchThreadID)
{
    uint row = id.x;
    if (row >= count)
    {
        return;
    }
    Rows4 blended = skin_none();
    uint end = SkinStatic[skin_ptr + row + 1];
    for (uint e = SkinStatic[skin_ptr + row]; e < end; ++e)
    {
        float weight = skinned_weight(skin_weight, e, skin_weight_width, skin_weight_step);
        blended = skin_add(blended, weight, skin_joint(skinned_code(skin_column, e, skin_column_width)));
    }
    float3 posed = transform_point(blended, Mesh[first + row].xyz);
    uint late_end = SkinStatic[late_ptr + row + 1];
    for (uint l = SkinStatic[late_ptr + row]; l < late_end; ++l)
    {
        uint column = skinned_code(late_column, l, late_column_width);
        float3 delta = skinned_signed3(late_position, 3 * l, late_position_width, late_position_step + 3 * column);
        posed = late_add(posed, Pose[late + column], delta);
    }
    Mesh[first + row] = float4(posed, 1);
}
