// Generated from hlsl/composite.hlsl, entry composite_pixel, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct CompositeConstants
{
    float4 background;
    float linear_target;
    float flip_rows;
    float2 image_size;
};

struct composite_pixel_out
{
    float4 _entryPointOutput [[color(0)]];
};

static inline __attribute__((always_inline))
float3 linear_from_display(thread const float3& srgb)
{
    float3 low = srgb / float3(12.9200000762939453125);
    float3 high = pow(fast::max((srgb + float3(0.054999999701976776123046875)) / float3(1.05499994754791259765625), float3(0.0)), float3(2.400000095367431640625));
    return float3((srgb.x <= 0.040449999272823333740234375) ? low.x : high.x, (srgb.y <= 0.040449999272823333740234375) ? low.y : high.y, (srgb.z <= 0.040449999272823333740234375) ? low.z : high.z);
}

static inline __attribute__((always_inline))
float4 _composite_pixel(thread const float4& position, constant CompositeConstants& constants, texture2d<float> Accumulated)
{
    float y = (constants.flip_rows != 0.0) ? (constants.image_size.y - position.y) : position.y;
    float4 colour = Accumulated.read(uint2(int3(int(position.x), int(y), 0).xy), int3(int(position.x), int(y), 0).z);
    float left = 1.0 - colour.w;
    float alpha = colour.w + (left * constants.background.w);
    float3 display = colour.xyz + (constants.background.xyz * (left * constants.background.w));
    if (constants.linear_target != 0.0)
    {
        float3 straight = select(display, display / float3(alpha), bool3(alpha > 0.0));
        float3 param = straight;
        display = linear_from_display(param) * alpha;
    }
    return float4(display, alpha);
}

fragment composite_pixel_out composite_pixel(constant CompositeConstants& constants [[buffer(8)]], texture2d<float> Accumulated [[texture(0)]], float4 gl_FragCoord [[position]])
{
    composite_pixel_out out = {};
    float4 position = gl_FragCoord;
    float4 param = position;
    out._entryPointOutput = _composite_pixel(param, constants, Accumulated);
    return out;
}

