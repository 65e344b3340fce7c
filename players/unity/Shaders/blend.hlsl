// Copy of avatar_shaders/hlsl/blend.hlsl, by `python -m avatar_shaders`; do not edit.
// Stage `blend`, one thread a Gaussian: adds its sparse deltas in their stored order, without atomics.
// Reads: BlendStatic, Pose. Writes: Splats, Sh.
#include "platform_core.hlsl"
#include "packed_core.hlsl"
#include "blend_core.hlsl"

StructuredBuffer<uint> BlendStatic; // sections at the offsets below
StructuredBuffer<float> Pose;
RWStructuredBuffer<float4> Splats; // [5 count]: mean and opacity; quaternion; 3 rows of sh_rotation with scale in w
RWStructuredBuffer<float> Sh; // [3 sh_terms, count]: plane 3 k + channel

AVATAR_PACKED(blend, BlendStatic)

// X_width: bits of an element. X_scale: low and step of each channel. X_step: a float an expression and channel.
AVATAR_CONSTANTS(BlendConstants)
    uint count;
    uint sh_terms; // coefficients a channel: 1, 4, 9, 16
    uint weights; // in Pose
    uint base_mean; // 3 planes of count elements
    uint base_mean_width;
    uint base_mean_scale;
    uint base_log_scale; // 3 planes
    uint base_log_scale_width;
    uint base_log_scale_scale;
    uint base_quat; // 4 planes, wxyz
    uint base_quat_width;
    uint base_quat_scale;
    uint base_opacity; // 1 plane
    uint base_opacity_width;
    uint base_opacity_table; // logits
    uint base_sh; // 3 sh_terms planes
    uint base_sh_width;
    uint base_sh_scale;
    uint geometry_ptr; // count + 1, width 32
    uint geometry_column; // an expression an entry
    uint geometry_column_width;
    uint geometry_mean; // 3 an entry
    uint geometry_mean_width;
    uint geometry_mean_step;
    uint geometry_quat; // 4 an entry
    uint geometry_quat_width;
    uint geometry_quat_step;
    uint appearance_ptr; // count + 1, width 32
    uint appearance_column; // an expression an entry
    uint appearance_column_width;
    uint appearance_log_scale; // 3 an entry
    uint appearance_log_scale_width;
    uint appearance_log_scale_step;
    uint appearance_opacity; // 1 an entry
    uint appearance_opacity_width;
    uint appearance_opacity_step;
    uint appearance_sh; // 3 sh_terms an entry
    uint appearance_sh_width;
    uint appearance_sh_step;
    uint unused;
AVATAR_CONSTANTS_END

float3 blend_base_sh(uint t, uint row)
{
    return blend_linear3(base_sh, t * count + row, count, base_sh_width, base_sh_scale + 2 * t);
}

BlendGeometry blended_geometry(uint row)
{
    BlendGeometry g;
    g.mean = blend_linear3(base_mean, row, count, base_mean_width, base_mean_scale);
    g.quat_wxyz = float4(
        blend_linear(base_quat, row, base_quat_width, base_quat_scale),
        blend_linear3(base_quat, count + row, count, base_quat_width, base_quat_scale + 2));
    uint end = BlendStatic[geometry_ptr + row + 1];
    for (uint e = BlendStatic[geometry_ptr + row]; e < end; ++e)
    {
        uint column = blend_code(geometry_column, e, geometry_column_width);
        float weight = Pose[weights + column];
        if (weight != 0)
        {
            float3 mean = blend_signed3(geometry_mean, 3 * e, geometry_mean_width, geometry_mean_step + 3 * column);
            uint step = geometry_quat_step + 4 * column;
            float4 quat_wxyz = float4(
                blend_signed(geometry_quat, 4 * e, geometry_quat_width, step),
                blend_signed3(geometry_quat, 4 * e + 1, geometry_quat_width, step + 1));
            g = blend_geometry(g, weight, mean, quat_wxyz);
        }
    }
    return g;
}

BlendAppearance blended_appearance(uint row)
{
    BlendAppearance a;
    a.log_scale = blend_linear3(base_log_scale, row, count, base_log_scale_width, base_log_scale_scale);
    a.opacity_logit = blend_table(base_opacity, row, base_opacity_width, base_opacity_table);
    uint end = BlendStatic[appearance_ptr + row + 1];
    for (uint e = BlendStatic[appearance_ptr + row]; e < end; ++e)
    {
        uint column = blend_code(appearance_column, e, appearance_column_width);
        float weight = Pose[weights + column];
        if (weight != 0)
        {
            float3 log_scale = blend_signed3(
                appearance_log_scale, 3 * e, appearance_log_scale_width, appearance_log_scale_step + 3 * column);
            float opacity_logit = blend_signed(
                appearance_opacity, e, appearance_opacity_width, appearance_opacity_step + column);
            a = blend_appearance(a, weight, log_scale, opacity_logit);
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
    uint last = sh_terms - 1, terms = 3 * sh_terms;
    uint t0 = 3 * k, t1 = 3 * min(k + 1, last), t2 = 3 * min(k + 2, last), t3 = 3 * min(k + 3, last);
    float3 c0 = blend_base_sh(t0, row), c1 = blend_base_sh(t1, row);
    float3 c2 = blend_base_sh(t2, row), c3 = blend_base_sh(t3, row);
    uint end = BlendStatic[appearance_ptr + row + 1];
    if (appearance_sh_width == 0)
    {
        end = 0;
    }
    for (uint e = BlendStatic[appearance_ptr + row]; e < end; ++e)
    {
        uint column = blend_code(appearance_column, e, appearance_column_width);
        float weight = Pose[weights + column];
        if (weight != 0)
        {
            uint at = terms * e, step = appearance_sh_step + terms * column;
            c0 = blend_sh(c0, weight, blend_signed3(appearance_sh, at + t0, appearance_sh_width, step + t0));
            c1 = blend_sh(c1, weight, blend_signed3(appearance_sh, at + t1, appearance_sh_width, step + t1));
            c2 = blend_sh(c2, weight, blend_signed3(appearance_sh, at + t2, appearance_sh_width, step + t2));
            c3 = blend_sh(c3, weight, blend_signed3(appearance_sh, at + t3, appearance_sh_width, step + t3));
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
