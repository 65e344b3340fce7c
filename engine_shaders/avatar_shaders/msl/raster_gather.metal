// Generated from hlsl/raster_gather.hlsl, entry raster_gather, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct RasterGatherConstants
{
    uint count;
    uint begin;
    uint piece_count;
    uint first;
    uint chunk_count;
    uint reverse;
};

struct Pairs
{
    uint2 _data[1];
};

struct Projected
{
    float4 _data[1];
};

struct Quads
{
    float4 _data[1];
};

static inline __attribute__((always_inline))
void _raster_gather(thread const uint3& id, constant RasterGatherConstants& constants, const device Pairs& Pairs_1, const device Projected& Projected_1, device Quads& Quads_1)
{
    uint instance = id.x;
    if (instance >= constants.piece_count)
    {
        return;
    }
    uint rank = constants.begin + instance;
    uint row = ((device uint*)&Pairs_1._data[(constants.reverse != 0u) ? ((constants.count - 1u) - rank) : rank])[1u] - constants.first;
    if (row >= constants.chunk_count)
    {
        return;
    }
    float4 place = Projected_1._data[row];
    float4 conic = Projected_1._data[constants.chunk_count + row];
    float4 rgb = Projected_1._data[(2u * constants.chunk_count) + row];
    Quads_1._data[3u * instance] = float4(place.xy, rgb.w, place.w);
    Quads_1._data[(3u * instance) + 1u] = float4(conic.xyz, 0.0);
    Quads_1._data[(3u * instance) + 2u] = float4(rgb.xyz, 0.0);
}

kernel void raster_gather(const device Projected& Projected_1 [[buffer(0)]], const device Pairs& Pairs_1 [[buffer(1)]], device Quads& Quads_1 [[buffer(2)]], constant RasterGatherConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _raster_gather(param, constants, Pairs_1, Projected_1, Quads_1);
}

