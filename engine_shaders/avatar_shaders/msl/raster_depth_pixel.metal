// Generated from hlsl/raster_depth.hlsl, entry raster_depth_pixel, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct QuadFragment
{
    float4 position;
    float2 centre;
    float4 form;
    float3 rgb;
};

struct RasterDepthConstants
{
    packed_float3 raster_constants;
    float depth_alpha;
};

struct raster_depth_pixel_in
{
    float2 q_centre [[user(locn0), flat]];
    float4 q_form [[user(locn1), flat]];
    float3 q_rgb [[user(locn2), flat]];
};

static inline __attribute__((always_inline))
float splat_level(thread const float2& offset, thread const float4& form)
{
    float power = (offset.x * ((form.x * offset.x) + (form.y * offset.y))) + ((form.z * offset.y) * offset.y);
    return (power > 0.0) ? (-1.0) : (power + form.w);
}

static inline __attribute__((always_inline))
float4 splat_fragment(thread const float3& rgb, thread const float& level0)
{
    float alpha = fast::min(0.9900000095367431640625, exp2(level0) * 0.0039215688593685626983642578125);
    return float4(rgb * alpha, alpha);
}

static inline __attribute__((always_inline))
void _raster_depth_pixel(thread const QuadFragment& q, constant RasterDepthConstants& constants)
{
    float2 param = q.centre - q.position.xy;
    float4 param_1 = q.form;
    float level0 = splat_level(param, param_1);
    float3 param_2 = q.rgb;
    float param_3 = level0;
    if ((level0 < 0.0) || (splat_fragment(param_2, param_3).w < constants.depth_alpha))
    {
        discard_fragment();
    }
}

fragment void raster_depth_pixel(raster_depth_pixel_in in [[stage_in]], constant RasterDepthConstants& constants [[buffer(8)]], float4 gl_FragCoord [[position]])
{
    QuadFragment q;
    q.position = gl_FragCoord;
    q.centre = in.q_centre;
    q.form = in.q_form;
    q.rgb = in.q_rgb;
    QuadFragment param = q;
    _raster_depth_pixel(param, constants);
}

