// Copy of avatar_shaders/hlsl/skin.hlsli, by `python -m avatar_shaders`; do not edit.
// Core of stage `skin` and of binding `skin`: linear blend skinning of vertices and of Gaussians.
// Reads: nothing. Writes: nothing.
#ifndef AVATAR_SKIN_HLSLI
#define AVATAR_SKIN_HLSLI

#include "splat_core.hlsl"

// Adds one joint to the blended matrix sum_b W_b A_b, which is applied once.
Rows4 skin_add(Rows4 sum, float weight, Rows4 joint)
{
    sum.row0 += weight * joint.row0;
    sum.row1 += weight * joint.row1;
    sum.row2 += weight * joint.row2;
    return sum;
}

Rows4 skin_none()
{
    Rows4 sum;
    sum.row0 = float4(0, 0, 0, 0);
    sum.row1 = float4(0, 0, 0, 0);
    sum.row2 = float4(0, 0, 0, 0);
    return sum;
}

// Late morphs (eyelids) are added to the skinned position without a rotation.
float3 late_add(float3 posed, float weight, float3 delta)
{
    return posed + weight * delta;
}

#endif
