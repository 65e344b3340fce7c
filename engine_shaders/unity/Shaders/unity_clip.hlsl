// Where a Unity shader draws in its target, and which row it draws. Reads: nothing. Writes: nothing.
#ifndef AVATAR_UNITY_CLIP_HLSL
#define AVATAR_UNITY_CLIP_HLSL

// Clip position for the target of the current camera, from Direct3D's: y up, z in 0..w. Unity turns the rows of
// targets that begin with the top one (_ProjectionParams.x is -1 then); OpenGL has z in -w..w.
float4 unity_clip(float4 position)
{
#if defined(SHADER_API_GLCORE) || defined(SHADER_API_GLES3)
    position.z = 2 * position.z - position.w;
#endif
    return float4(position.x, position.y * _ProjectionParams.x, position.zw);
}

// Rows from the top of the picture for an SV_Position.y, which counts rows of the target.
float row_from_top(float y, float rows)
{
#if UNITY_UV_STARTS_AT_TOP
    return _ProjectionParams.x < 0 ? rows - y : y;
#else
    return rows - y;
#endif
}

#endif
