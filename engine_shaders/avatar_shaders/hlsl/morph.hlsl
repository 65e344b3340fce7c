// Stage `morph`, one thread a vertex: V = template + sum_k w_k morph_k + sum_f feature_f corrective_f.
// Reads: MorphStatic, Pose. Writes: Mesh.
#include "platform.hlsli"
#include "morph.hlsli"

StructuredBuffer<uint> MorphStatic; // sections at the offsets below
StructuredBuffer<float> Pose;
RWStructuredBuffer<float4> Mesh; // [3 or 5 vertices]: positions, normals, quaternions; positions are written

AVATAR_CONSTANTS(MorphConstants)
    uint first; // vertices first .. first + count
    uint count;
    uint vertices;
    uint template_plane; // 3 planes of count floats
    uint morph_ptr; // count + 1
    uint morph_entry; // of 4: expression, delta
    uint corrective_ptr; // count + 1
    uint corrective_entry; // of 4: feature, delta
    uint weights; // in Pose
    uint features; // in Pose
AVATAR_CONSTANTS_END

float3 morph_sum(float3 position, uint row, uint ptr, uint entry, uint pose)
{
    uint end = MorphStatic[ptr + row + 1];
    for (uint e = MorphStatic[ptr + row]; e < end; ++e)
    {
        uint at = entry + 4 * e;
        float weight = Pose[pose + MorphStatic[at]];
        if (weight != 0)
        {
            float3 delta = float3(
                asfloat(MorphStatic[at + 1]), asfloat(MorphStatic[at + 2]), asfloat(MorphStatic[at + 3]));
            position = morph_add(position, weight, delta);
        }
    }
    return position;
}

[numthreads(AVATAR_THREADS, 1, 1)]
void morph(uint3 id : SV_DispatchThreadID)
{
    uint row = id.x;
    if (row >= count)
    {
        return;
    }
    uint at = template_plane + row;
    float3 position = float3(
        asfloat(MorphStatic[at]), asfloat(MorphStatic[at + count]), asfloat(MorphStatic[at + 2 * count]));
    position = morph_sum(position, row, morph_ptr, morph_entry, weights);
    position = morph_sum(position, row, corrective_ptr, corrective_entry, features);
    Mesh[first + row] = float4(position, 1);
}
