// Copy of avatar_shaders/hlsl/blend.hlsli, by `python -m avatar_shaders`; do not edit.
// Core of stage `blend`: Gaussian blendshapes in training space, G = base + sum_k w_k delta_k.
// Reads: nothing. Writes: nothing.
//
// Raw quaternions, log scales and opacity logits are added. Nothing is activated or normalised here.
#ifndef AVATAR_BLEND_HLSLI
#define AVATAR_BLEND_HLSLI

struct BlendGeometry
{
    float3 mean;
    float4 quat_wxyz;
};

struct BlendAppearance
{
    float3 log_scale;
    float opacity_logit;
};

BlendGeometry blend_geometry(BlendGeometry g, float weight, float3 mean, float4 quat_wxyz)
{
    g.mean += weight * mean;
    g.quat_wxyz += weight * quat_wxyz;
    return g;
}

BlendAppearance blend_appearance(BlendAppearance a, float weight, float3 log_scale, float opacity_logit)
{
    a.log_scale += weight * log_scale;
    a.opacity_logit += weight * opacity_logit;
    return a;
}

float3 blend_sh(float3 coefficient, float weight, float3 delta)
{
    return coefficient + weight * delta;
}

#endif
