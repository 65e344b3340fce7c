// Quads of the accumulated image in Unity: batches of splats, from a storage buffer or from a texture.
// Reads: Quads, or QuadTexels with AVATAR_QUAD_TEXTURE; _CameraDepthTexture. Writes: nothing.
//
// The image lies in memory as Unity's render textures do: row 0 is the bottom row. So a fragment reads the depth of
// the scene, and later the camera's target, at its own row. Nothing here depends on the camera's matrices.
#ifndef AVATAR_UNITY_QUAD_HLSL
#define AVATAR_UNITY_QUAD_HLSL

#include "unity_textures.hlsl"
#include "Packages/com.avatar-export.player/Made/raster.hlsl"

#ifdef AVATAR_DEPTH_ARRAY
Texture2DArray<float> _CameraDepthTexture; // one slice an eye
#else
AVATAR_FLOAT_TEXTURE(_CameraDepthTexture);
#endif

uint quad_count; // splats
uint depth_slice; // the eye
float depth_sign; // 1: near points have smaller depths; -1: larger ones; 0: there is no depth

struct SplatFragment
{
    float4 position : SV_Position;
    nointerpolation float2 centre : TEXCOORD0;
    nointerpolation float4 form : TEXCOORD1;
    nointerpolation float4 rgb_depth : TEXCOORD2; // depth as the depth buffer has it
};

// A splat that is drawn nowhere has the opacity 0.
void load_quad(uint splat, out float4 place, out float3 conic, out float3 rgb)
{
    place = float4(0, 0, 0, 0);
    conic = float3(0, 0, 0);
    rgb = float3(0, 0, 0);
    if (splat < quad_count)
    {
#ifdef AVATAR_QUAD_TEXTURE
        int3 at = int3(3 * (splat % AVATAR_QUAD_ROW), splat / AVATAR_QUAD_ROW, 0);
        place = QuadTexels.Load(at);
        conic = QuadTexels.Load(at + int3(1, 0, 0)).xyz;
        rgb = QuadTexels.Load(at + int3(2, 0, 0)).xyz;
#else
        place = Quads[3 * splat];
        conic = Quads[3 * splat + 1].xyz;
        rgb = Quads[3 * splat + 2].xyz;
#endif
    }
}

// Vertex 4 k + c is corner c of splat k of the batch.
SplatFragment splat_vertex(uint vertex, uint batch)
{
    float4 place;
    float3 conic, rgb;
    load_quad(batch * AVATAR_QUAD_BATCH + vertex / 4, place, conic, rgb);
    QuadFragment quad = quad_vertex(vertex, place, conic, rgb);
    SplatFragment splat;
    // Depth is compared by the fragment, so that no rule of an API about clip z matters.
    splat.position = float4(quad.position.xy, 0.5, 1);
    splat.centre = quad.centre;
    splat.form = quad.form;
    splat.rgb_depth = float4(quad.rgb, place.z);
    return splat;
}

bool is_hidden(int2 pixel, float depth)
{
#ifdef AVATAR_DEPTH_ARRAY
    float scene = _CameraDepthTexture.Load(int4(pixel, depth_slice, 0));
#else
    float scene = _CameraDepthTexture.Load(int3(pixel, 0)).x;
#endif
    return depth_sign * (depth - scene) > 0;
}

float4 splat_pixel(SplatFragment splat)
{
    QuadFragment quad;
    quad.position = splat.position;
    quad.position.y = image_size.y - splat.position.y; // centres count rows from the top of the image
    quad.centre = splat.centre;
    quad.form = splat.form;
    quad.rgb = splat.rgb_depth.xyz;
    float4 colour = raster_pixel(quad);
    if (is_hidden(int2(splat.position.xy), splat.rgb_depth.w))
    {
        discard;
    }
    return colour;
}

#endif
