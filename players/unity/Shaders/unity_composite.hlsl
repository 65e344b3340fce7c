// The accumulated image onto a camera's target in Unity.
// Reads: Accumulated. Writes: nothing.
#ifndef AVATAR_UNITY_COMPOSITE_HLSL
#define AVATAR_UNITY_COMPOSITE_HLSL

#include "unity_textures.hlsl"
#include "Packages/com.avatar-export.player/Made/composite.hlsl"

float4 _ProjectionParams; // x: -1 where the Built-in pipeline draws upside down, into a texture
float2 target_first; // the pixel of the target, counted from its bottom row, that shows the image's bottom left corner
float target_rows; // of the whole target
float top_row_first; // 1: the target begins with its top row; 0: with the bottom row; -1: _ProjectionParams says

// A target begins with the bottom row, as the image does, but for a screen of an API whose rows begin at the top.
float4 composite_target(float4 position)
{
    bool turned = top_row_first < 0 ? _ProjectionParams.x > 0 : top_row_first > 0;
    position.y = turned ? target_rows - position.y : position.y;
    position.xy -= target_first;
    return composite_pixel(position);
}

#endif
