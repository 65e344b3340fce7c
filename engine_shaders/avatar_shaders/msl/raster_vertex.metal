// Generated from hlsl/raster.hlsl, entry raster_vertex, by `python -m avatar_shaders`; do not edit.
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

struct RasterConstants
{
    float2 image_size;
    float flip_y;
};

struct Quads
{
    float4 _data[1];
};

struct raster_vertex_out
{
    float2 _entryPointOutput_centre [[user(locn0)]];
    float4 _entryPointOutput_form [[user(locn1)]];
    float3 _entryPointOutput_rgb [[user(locn2)]];
    float4 gl_Position [[position]];
};

struct raster_vertex_in
{
    float4 quad0 [[attribute(0)]];
    float4 quad1 [[attribute(1)]];
    float4 quad2 [[attribute(2)]];
};

static inline __attribute__((always_inline))
float4 splat_form(thread const float3& conic, thread const float& opacity)
{
    float most = log2(opacity * 255.0);
    return float4((-0.721347510814666748046875) * conic.x, (-1.44269502162933349609375) * conic.y, (-0.721347510814666748046875) * conic.z, most);
}

static inline __attribute__((always_inline))
float2 splat_corner(thread float2& corner, thread const float2& centre, thread const float3& conic, thread const float& most, thread const float2& size)
{
    float reach = 1.38629436492919921875 * fast::max(most, 0.0);
    float det = ((conic.x * conic.z) - (conic.y * conic.y)) - (3.0000001061125658452510833740234e-07 * ((conic.x * conic.z) + (conic.y * conic.y)));
    if (!(det > 0.0))
    {
        return (((corner * 0.5) + float2(0.5)) * size) - float2(0.5);
    }
    float mid = 0.5 * (conic.x + conic.z);
    float half_gap = 0.5 * (conic.x - conic.z);
    float larger = mid + sqrt((half_gap * half_gap) + (conic.y * conic.y));
    float2 axis = select(float2(conic.y, larger - conic.x), float2(larger - conic.z, conic.y), bool2(half_gap >= 0.0));
    float axis_length = length(axis);
    axis = select(float2(1.0, 0.0), axis / float2(axis_length), bool2(axis_length > 0.0));
    float across = fast::min(sqrt(reach / larger), 1000000.0) + 0.125;
    float along = fast::min(sqrt((reach * larger) / det), 1000000.0) + 0.125;
    if (along < 8.0)
    {
        corner = select(float2(0.0, 2.0), float2(1.73205077648162841796875 * corner.x, -1.0), bool2(corner.y < 0.0));
    }
    return (centre + (axis * (corner.x * across))) + (float2(-axis.y, axis.x) * (corner.y * along));
}

static inline __attribute__((always_inline))
float4 clip_from_pixels(thread const float2& pixel, thread const float& clip_depth, thread const float2& size, thread const float& flip_y)
{
    float2 ndc = (((pixel * 2.0) + float2(1.0)) / size) - float2(1.0);
    return float4(ndc.x, (-flip_y) * ndc.y, clip_depth, 1.0);
}

static inline __attribute__((always_inline))
QuadFragment quad_vertex(thread const uint& vertex0, thread const float4& place, thread const float3& conic, thread const float3& rgb, constant RasterConstants& constants)
{
    QuadFragment q;
    q.centre = place.xy + float2(0.5);
    float3 param = conic;
    float param_1 = place.w;
    q.form = splat_form(param, param_1);
    q.rgb = rgb;
    q.position = float4(2.0, 2.0, 0.0, 1.0);
    if (q.form.w >= 0.0)
    {
        float2 corner = float2(float(((vertex0 & 1u) != 0u) ? 1 : (-1)), float(((vertex0 & 2u) != 0u) ? 1 : (-1)));
        float2 param_2 = corner;
        float2 param_3 = place.xy;
        float3 param_4 = conic;
        float param_5 = q.form.w;
        float2 param_6 = constants.image_size;
        float2 _320 = splat_corner(param_2, param_3, param_4, param_5, param_6);
        float2 pixel = _320;
        float2 param_7 = pixel;
        float param_8 = place.z;
        float2 param_9 = constants.image_size;
        float param_10 = constants.flip_y;
        q.position = clip_from_pixels(param_7, param_8, param_9, param_10);
    }
    return q;
}

static inline __attribute__((always_inline))
QuadFragment _raster_vertex(thread const float4& quad0, thread const float4& quad1, thread const float4& quad2, thread const uint& vertex0, constant RasterConstants& constants)
{
    uint param = vertex0;
    float4 param_1 = quad0;
    float3 param_2 = quad1.xyz;
    float3 param_3 = quad2.xyz;
    return quad_vertex(param, param_1, param_2, param_3, constants);
}

vertex raster_vertex_out raster_vertex(raster_vertex_in in [[stage_in]], constant RasterConstants& constants [[buffer(8)]], uint gl_VertexIndex [[vertex_id]])
{
    raster_vertex_out out = {};
    float4 quad0 = in.quad0;
    float4 quad1 = in.quad1;
    float4 quad2 = in.quad2;
    uint vertex0 = gl_VertexIndex;
    float4 param = quad0;
    float4 param_1 = quad1;
    float4 param_2 = quad2;
    uint param_3 = vertex0;
    QuadFragment flattenTemp = _raster_vertex(param, param_1, param_2, param_3, constants);
    out.gl_Position = flattenTemp.position;
    out._entryPointOutput_centre = flattenTemp.centre;
    out._entryPointOutput_form = flattenTemp.form;
    out._entryPointOutput_rgb = flattenTemp.rgb;
    return out;
}

