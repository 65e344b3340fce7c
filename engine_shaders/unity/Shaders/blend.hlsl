// Copy of avatar_shaders/hlsl/blend.hlsl, by `python -m avatar_shaders`; do not edit.
// Stage `blend`, one thread a Gaussian: adds its sparse deltas in their stored order, without atomics.
// Reads: BlendStatic, Pose. Writes: Splats, Sh.
#include "platform_core.hlsl"
#include "blend_core.hlsl"

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

float3 blend_base3(uint plane, uint row)
{
    return float3(blend_base(plane, row), blend_base(plane + 1, row), blend_base(plane + 2, row));
}

BlendGeometry blended_geometry(uint row)
{
    BlendGeometry g;
    g.mean = blend_base3(0, row);
    g.quat_wxyz = float4(blend_base(6, row), blend_base3(7, row));
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
    return g;
}

BlendAppearance blended_appearance(uint row)
{
    BlendAppearance a;
    a.log_scale = blend_base3(3, row);
    a.opacity_logit = blend_base(10, row);
    uint end = BlendStatic[appearance_ptr + row + 1];
    for (uint e = BlendStatic[appearance_ptr + row]; e < end; ++e)
    {
        uint at = appearance_entry + (5 + 3 * sh_terms) * e;
        float weight = Pose[weights + BlendStatic[at]];
        if (weight != 0)
        {
            a = blend_appearance(a, weight, blend_value3(at + 1), blend_value(at + 4));
        }
    }
    return a;
}

void blend_store_sh(uint k, uint row, float3 coefficient)
{
    if (k < sh_terms)
    {
        uint at = 3 * k * count + row;
        Sh[at] = coefficient.x;
        Sh[at + count] = coefficient.y;
        Sh[at + 2 * count] = coefficient.z;
    }
}

// Four coefficients at a time stay in registers during the loop over entries. Indices past the last take the last.
void blend_sh_from(uint k, uint row)
{
    uint last = sh_terms - 1, stride = 5 + 3 * sh_terms;
    uint t0 = 3 * k, t1 = 3 * min(k + 1, last), t2 = 3 * min(k + 2, last), t3 = 3 * min(k + 3, last);
    float3 c0 = blend_base3(11 + t0, row), c1 = blend_base3(11 + t1, row);
    float3 c2 = blend_base3(11 + t2, row), c3 = blend_base3(11 + t3, row);
    uint end = BlendStatic[appearance_ptr + row + 1];
    for (uint e = BlendStatic[appearance_ptr + row]; e < end; ++e)
    {
        uint at = appearance_entry + stride * e;
        float weight = Pose[weights + BlendStatic[at]];
        if (weight != 0)
        {
            c0 = blend_sh(c0, weight, blend_value3(at + 5 + t0));
            c1 = blend_sh(c1, weight, blend_value3(at + 5 + t1));
            c2 = blend_sh(c2, weight, blend_value3(at + 5 + t2));
            c3 = blend_sh(c3, weight, blend_value3(at + 5 + t3));
        }
    }
    blend_store_sh(k, row, c0);
    blend_store_sh(k + 1, row, c1);
    blend_store_sh(k + 2, row, c2);
    blend_store_sh(k + 3, row, c3);
}

[numthreads(AVATAR_THREADS, 1, 1)]
void blend(uint3 id : SV_DispatchThreadID)
{
    uint row = id.x;
    if (row >= count)
    {
        return;
    }
    BlendGeometry g = blended_geometry(row);
    BlendAppearance a = blended_appearance(row);
    Splats[row] = float4(g.mean, a.opacity_logit);
    Splats[count + row] = g.quat_wxyz;
    Splats[2 * count + row] = float4(1, 0, 0, a.log_scale.x);
    Splats[3 * count + row] = float4(0, 1, 0, a.log_scale.y);
    Splats[4 * count + row] = float4(0, 0, 1, a.log_scale.z);
    for (uint k = 0; k < sh_terms; k += 4)
    {
        blend_sh_from(k, row);
    }
}
