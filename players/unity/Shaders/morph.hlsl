// Copy of avatar_shaders/hlsl/morph.hlsl, by `python -m avatar_shaders`; do not edit.
// Stage `morph`, one thread a vertex: V = template + sum_k w_k morph_k + sum_f feature_f corrective_f.
// Reads: MorphStatic, Pose. Writes: Mesh.
#include "platform_core.hlsl"
#include "packed_core.hlsl"
#include "morph_core.hlsl"

StructuredBuffer<uint> MorphStatic; // sections at the offsets below
StructuredBuffer<float> Pose;
RWStructuredBuffer<float4> Mesh; // [3 or 5 vertices]: positions, normals, quaternions; positions are written

AVATAR_PACKED(morph, MorphStatic)

// X_width: bits of an element. template_scale: low and step of each axis. X_step: a float a column and axis.
AVATAR_CONSTANTS(MorphConstants)
    uint first; // vertices first .. first + count
    uint count;
    uint vertices;
    uint template_position; // 3 planes of count elements
    uint template_position_width;
    uint template_position_scale;
    uint morph_ptr; // count + 1, width 32
    uint morph_column; // an expression an entry
    uint morph_column_width;
    uint morph_position; // 3 an entry
    uint morph_position_width;
    uint morph_position_step;
    uint corrective_ptr; // count + 1, width 32
    uint corrective_column; // a feature an entry
    uint corrective_column_width;
    uint corrective_position; // 3 an entry
    uint corrective_position_width;
    uint corrective_position_step;
    uint weights; // in Pose
    uint features; // in Pose
AVATAR_CONSTANTS_END

float3 morphed(float3 position, uint row)
{
    uint end = MorphStatic[morph_ptr + row + 1];
    for (uint e = MorphStatic[morph_ptr + row]; e < end; ++e)
    {
        uint column = morph_code(morph_column, e, morph_column_width);
        float weight = Pose[weights + column];
        if (weight != 0)
        {
            uint step = morph_position_step + 3 * column;
            position = morph_add(position, weight, morph_signed3(morph_position, 3 * e, morph_position_width, step));
        }
    }
    return position;
}

float3 corrected(float3 position, uint row)
{
    uint end = MorphStatic[corrective_ptr + row + 1];
    for (uint e = MorphStatic[corrective_ptr + row]; e < end; ++e)
    {
        uint column = morph_code(corrective_column, e, corrective_column_width);
        float feature = Pose[features + column];
        if (feature != 0)
        {
            uint step = corrective_position_step + 3 * column;
            position = morph_add(
                position, feature, morph_signed3(corrective_position, 3 * e, corrective_position_width, step));
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
    float3 position = morph_linear3(
        template_position, row, count, template_position_width, template_position_scale);
    Mesh[first + row] = float4(corrected(morphed(position, row), row), 1);
}
