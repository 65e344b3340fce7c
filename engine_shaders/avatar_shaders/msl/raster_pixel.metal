// Generated from hlsl/raster.hlsl, entry raster_pixel, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct QuadFragment
{
    float4 position;
    float4 place;
    float3 conic;
    float3 rgb;
};

struct Quads
{
    float4 _data[1];
};

struct RasterConstants
{
    float2 image_size;
    float flip_y;
};

struct raster_pixel_out
{
    float4 _entryPointOutput [[color(0)]];
};

struct raster_pixel_in
{
    float4 q_place [[user(locn0), flat]];
    float3 q_conic [[user(locn1), flat]];
    float3 q_rgb [[user(locn2), flat]];
};

static inline __attribute__((always_inline))
float splat_alpha(thread const float2& offset, thread const float3& conic, thread const float& opacity)
{
    float power = ((-0.5) * (((conic.x * offset.x) * offset.x) + ((conic.z * offset.y) * offset.y))) - ((conic.y * offset.x) * offset.y);
    float alpha = fast::min(0.9900000095367431640625, opacity * exp(power));
    return ((power > 0.0) || (alpha < 0.0039215688593685626983642578125)) ? 0.0 : alpha;
}

static inline __attribute__((always_inline))
float4 splat_fragment(thread const float3& rgb, thread const float& alpha)
{
    return float4(rgb * alpha, alpha);
}

static inline __attribute__((always_inline))
float4 _raster_pixel(thread const QuadFragment& q)
{
    float2 param = q.place.xy - (q.position.xy - float2(0.5));
    float3 param_1 = q.conic;
    float param_2 = q.place.w;
    float alpha = splat_alpha(param, param_1, param_2);
    if (alpha <= 0.0)
    {
        discard_fragment();
    }
    float3 param_3 = q.rgb;
    float param_4 = alpha;
    return splat_fragment(param_3, param_4);
}

fragment raster_pixel_out raster_pixel(raster_pixel_in in [[stage_in]], float4 gl_FragCoord [[position]])
{
    raster_pixel_out out = {};
    QuadFragment q;
    q.position = gl_FragCoord;
    q.place = in.q_place;
    q.conic = in.q_conic;
    q.rgb = in.q_rgb;
    QuadFragment param = q;
    float4 _150 = _raster_pixel(param);
    out._entryPointOutput = _150;
    return out;
}

