// Generated from hlsl/sort_keys.hlsl, entry sort_keys, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct SortKeysConstants
{
    uint count;
    uint first;
};

struct Pairs
{
    uint2 _data[1];
};

struct Projected
{
    float4 _data[1];
};

static inline __attribute__((always_inline))
uint sort_key(thread const float& depth, thread const float& radius)
{
    return (radius > 0.0) ? as_type<uint>(depth) : 4294967295u;
}

static inline __attribute__((always_inline))
void _sort_keys(thread const uint3& id, constant SortKeysConstants& constants, device Pairs& Pairs_1, const device Projected& Projected_1)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    float param = ((device float*)&Projected_1._data[row])[2u];
    float param_1 = ((device float*)&Projected_1._data[constants.count + row])[3u];
    Pairs_1._data[constants.first + row] = uint2(sort_key(param, param_1), constants.first + row);
}

kernel void sort_keys(const device Projected& Projected_1 [[buffer(0)]], device Pairs& Pairs_1 [[buffer(1)]], constant SortKeysConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _sort_keys(param, constants, Pairs_1, Projected_1);
}

