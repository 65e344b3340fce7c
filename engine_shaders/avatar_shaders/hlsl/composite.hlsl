// After stage `raster`: puts the accumulated image over a background, and converts it to linear light where the
// engine's target is linear; before it, copies the depth of the scene. A full-screen triangle of 3 vertices.
// Reads: Accumulated (composite_pixel), OpaqueDepth (depth_pixel), OpaqueSamples (depth_samples_pixel). Writes: nothing.
#include "platform.hlsli"
#include "raster.hlsli"

AVATAR_FLOAT_TEXTURE(Accumulated); // premultiplied, display-referred
AVATAR_FLOAT_TEXTURE(OpaqueDepth); // red: the depth of what the engine has drawn
Texture2DMS<float4> OpaqueSamples; // the same where pixels have several

AVATAR_CONSTANTS(CompositeConstants)
    float4 background; // display-referred rgb, and its alpha: 1 is opaque, 0 keeps the image's alpha
    float linear_target; // 1: the target holds linear light
    float flip_rows; // 1: the target's first row is the last row of the accumulated image
    float2 image_size; // pixels
AVATAR_CONSTANTS_END

float4 composite_vertex(uint vertex : SV_VertexID) : SV_Position
{
    return float4(vertex == 1 ? 3 : -1, vertex == 2 ? 3 : -1, 0, 1);
}

float4 composite_pixel(float4 position : SV_Position) : SV_Target
{
    float y = flip_rows != 0 ? image_size.y - position.y : position.y;
    float4 colour = Accumulated.Load(int3(int(position.x), int(y), 0));
    float left = 1 - colour.a;
    float alpha = colour.a + left * background.a;
    float3 display = colour.rgb + left * background.a * background.rgb;
    if (linear_target != 0)
    {
        // The transfer curve is for colours that are not multiplied by alpha.
        float3 straight = alpha > 0 ? display / alpha : display;
        display = linear_from_display(straight) * alpha;
    }
    return float4(display, alpha);
}

struct DepthFragment
{
    float4 colour : SV_Target; // masked out; Godot wants a target for every attachment
    float depth : SV_Depth;
};

DepthFragment depth_pixel(float4 position : SV_Position)
{
    DepthFragment made;
    made.colour = 0;
    made.depth = OpaqueDepth.Load(int3(int(position.x), int(position.y), 0)).r;
    return made;
}

DepthFragment depth_samples_pixel(float4 position : SV_Position)
{
    DepthFragment made;
    made.colour = 0;
    made.depth = OpaqueSamples.Load(int2(int(position.x), int(position.y)), 0).r;
    return made;
}
