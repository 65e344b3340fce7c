// Generated from hlsl/composite.hlsl, entry composite_vertex, by `python -m avatar_shaders`; do not edit.
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

struct composite_vertex_out
{
    float4 gl_Position [[position]];
};

static inline __attribute__((always_inline))
float4 _composite_vertex(thread const uint& vertex0)
{
    return float4(float((vertex0 == 1u) ? 3 : (-1)), float((vertex0 == 2u) ? 3 : (-1)), 0.0, 1.0);
}

vertex composite_vertex_out composite_vertex(uint gl_VertexIndex [[vertex_id]])
{
    composite_vertex_out out = {};
    uint vertex0 = gl_VertexIndex;
    uint param = vertex0;
    out.gl_Position = _composite_vertex(param);
    return out;
}

