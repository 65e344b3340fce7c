// Copy of avatar_shaders/hlsl/morph.hlsli, by `python -m avatar_shaders`; do not edit.
// Core of stage `morph`: the position of a mesh vertex before skinning.
// Reads: nothing. Writes: nothing.
#ifndef AVATAR_MORPH_HLSLI
#define AVATAR_MORPH_HLSLI

// V + weight * delta, one entry of a sparse row (an expression or a pose feature).
float3 morph_add(float3 position, float weight, float3 delta)
{
    return position + weight * delta;
}

#endif
