// Copy of avatar_shaders/hlsl/activate.hlsli, by `python -m avatar_shaders`; do not edit.
// Core of stage `activate`: from training space to scale, opacity and unit quaternion.
// Reads: nothing. Writes: nothing.
#ifndef AVATAR_ACTIVATE_HLSLI
#define AVATAR_ACTIVATE_HLSLI

// Standard deviations from log scales.
float3 activate_scale(float3 log_scale)
{
    return exp(log_scale);
}

// 1 / (1 + e^-x), without overflow.
float activate_opacity(float opacity_logit)
{
    float e = exp(-abs(opacity_logit));
    return (opacity_logit >= 0 ? 1.0 : e) / (1.0 + e);
}

// A unit quaternion. The zero quaternion stays zero.
float4 activate_quat(float4 quat_wxyz)
{
    return quat_wxyz / max(sqrt(dot(quat_wxyz, quat_wxyz)), 1e-12);
}

#endif
