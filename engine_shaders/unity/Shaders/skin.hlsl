// Copy of avatar_shaders/hlsl/skin.hlsl, by `python -m avatar_shaders`; do not edit.
// Stage `skin`, one thread a vertex: V' = (sum_b W_b A_b) V, then late morphs.
// Reads: SkinStatic, Pose. Writes: Mesh.
#include "platform_core.hlsl"
#include "skin_core.hlsl"

StructuredBuffer<uint> SkinStatic; // sections at the offsets below
StructuredBuffer<float> Pose;
RWStructuredBuffer<float4> Mesh; // [3 or 5 vertices]: positions are read and replaced

AVATAR_CONSTANTS(SkinConstants)
    uint first; // vertices first .. first + count
    uint count;
    uint late_ptr; // count + 1
    uint late_entry; // of 4: late morph, delta
    uint skin_ptr; // count + 1
    uint skin_entry; // of 2: joint, weight
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
        uint at = skin_entry + 2 * e;
        blended = skin_add(blended, asfloat(SkinStatic[at + 1]), skin_joint(SkinStatic[at]));
    }
    float3 posed = transform_point(blended, Mesh[first + row].xyz);
    uint late_end = SkinStatic[late_ptr + row + 1];
    for (uint l = SkinStatic[late_ptr + row]; l < late_end; ++l)
    {
        uint at = late_entry + 4 * l;
        float3 delta = float3(
            asfloat(SkinStatic[at + 1]), asfloat(SkinStatic[at + 2]), asfloat(SkinStatic[at + 3]));
        posed = late_add(posed, Pose[late + SkinStatic[at]], delta);
    }
    Mesh[first + row] = float4(posed, 1);
}
