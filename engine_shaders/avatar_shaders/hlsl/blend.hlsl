// Stage `blend`, one thread a Gaussian: sparse deltas summed as they are stored, without atomics.
// Reads: BlendStatic, Pose. Writes: Splats, Sh.
#include "platform.hlsli"
#include "blend.hlsli"

StructuredBuffer<uint> BlendStatic; // sections at the offsets below
StructuredBuffer<float> Pose;
RWStructuredBuffer<float4> Splats; // [5 count]: mean and opacity; quaternion; 3 rows of sh_rotation with scale in w
RWStructuredBuffer<float> Sh; // [3 sh_terms, count]: plane 3 k + channel

AVATAR_CONSTANTS(BlendConstants)
    uint count;
    uint sh_terms; // coefficients a channel: 1, 4, 9, 16
    uint base_plane; // planes of count floats: mean 3, log scale 3, quaternion 4, opacity logit 1, SH 3 sh_terms
    uint geometry_ptr; // count + 1
    uint geometry_entry; // of 8: expression, mean 3, quaternion 4
    uint appearance_ptr; // count + 1
    uint appearance_entry; // of 5 + 3 sh_terms: expression, log scale 3, opacity logit, SH
    uint weights; // in Pose
AVATAR_CONSTANTS_END

float blend_value(uint at)
{
    return asfloat(BlendStatic[at]);
}

float3 blend_value3(uint at)
{
    return float3(blend_value(at), blend_value(at + 1), blend_value(at + 2));
}

float blend_base(uint plane, uint row)
{
    return blend_value(base_plane + plane * count + row);
}

[numthreads(AVATAR_THREADS, 1, 1)]
void blend(uint3 id : SV_DispatchThreadID)
{
    uint row = id.x;
    if (row >= count)
    {
        return;
    }
    BlendGeometry g;
    g.mean = float3(blend_base(0, row), blend_base(1, row), blend_base(2, row));
    g.quat_wxyz = float4(blend_base(6, row), blend_base(7, row), blend_base(8, row), blend_base(9, row));
    uint end = BlendStatic[geometry_ptr + row + 1];
    for (uint e = BlendStatic[geometry_ptr + row]; e < end; ++e)
    {
        uint at = geometry_entry + 8 * e;
        float weight = Pose[weights + BlendStatic[at]];
        if (weight != 0)
        {
            g = blend_geometry(g, weight, blend_value3(at + 1), float4(blend_value(at + 4), blend_value3(at + 5)));
        }
    }
    BlendAppearance a;
    a.log_scale = float3(blend_base(3, row), blend_base(4, row), blend_base(5, row));
    a.opacity_logit = blend_base(10, row);
    uint terms = 3 * sh_terms;
    for (uint s = 0; s < terms; ++s)
    {
        Sh[s * count + row] = blend_base(11 + s, row);
    }
    uint appearance_end = BlendStatic[appearance_ptr + row + 1];
    for (uint i = BlendStatic[appearance_ptr + row]; i < appearance_end; ++i)
    {
        uint at = appearance_entry + (5 + terms) * i;
        float weight = Pose[weights + BlendStatic[at]];
        if (weight != 0)
        {
            a = blend_appearance(a, weight, blend_value3(at + 1), blend_value(at + 4));
            for (uint t = 0; t < terms; ++t)
            {
                uint plane = t * count + row;
                Sh[plane] = blend_sh(Sh[plane], weight, blend_value(at + 5 + t));
            }
        }
    }
    Splats[row] = float4(g.mean, a.opacity_logit);
    Splats[count + row] = g.quat_wxyz;
    Splats[2 * count + row] = float4(1, 0, 0, a.log_scale.x);
    Splats[3 * count + row] = float4(0, 1, 0, a.log_scale.y);
    Splats[4 * count + row] = float4(0, 0, 1, a.log_scale.z);
}
