// Textures in Unity, which reads them with 16 bits on phones unless told: too few for depths, and for places in pixels.
// Reads: nothing. Writes: nothing.
#ifndef AVATAR_UNITY_TEXTURES_HLSL
#define AVATAR_UNITY_TEXTURES_HLSL

#if defined(SHADER_API_GLES3) || defined(SHADER_API_VULKAN) || defined(SHADER_API_METAL)
#define AVATAR_FLOAT_TEXTURE(name) Texture2D_float name
#endif

#endif
