// Clip positions and rows of the target in Unity.
// Reads: nothing. Writes: nothing.
#ifndef AVATAR_UNITY_CLIP_HLSL
#define AVATAR_UNITY_CLIP_HLSL

// Clip position for the target of the current camera, from a clip position of Direct3D: y up, z in 0..w. Where the
// first row of the target is the top one, Unity draws upside down (_ProjectionParams.x is -1). OpenGL has z in -w..w.
float4 unity_clip(float4 position)
{
#if defined(SHADER_API_GLCORE) || defined(SHADER_API_GLES3)
    position.z = 2 * position.z - position.w;
#endif
    return float4(position.x, position.y * _ProjectionParams.x, position.zw);
}

// The row counted from the top of the image, from SV_Position.y, which counts rows of the target.
float row_from_top(float y, float rows)
{
#if UNITY_UV_STARTS_AT_TOP
    return _ProjectionParams.x < 0 ? rows - y : y;
#else
    return rows - y;
#endif
}

#endif
