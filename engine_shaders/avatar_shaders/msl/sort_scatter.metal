// Generated from hlsl/sort_scatter.hlsl, entry sort_scatter, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct SortScatterConstants
{
    uint count;
    uint groups;
    uint shift;
};

struct Pairs
{
    uint2 _data[1];
};

struct Counts
{
    uint _data[1];
};

struct PairsOut
{
    uint2 _data[1];
};

static inline __attribute__((always_inline))
uint sort_digit(thread const uint& key, thread const uint& shift)
{
    return (key >> shift) & 15u;
}

static inline __attribute__((always_inline))
void _sort_scatter(thread const uint3& group, thread const uint3& thread0, constant SortScatterConstants& constants, threadgroup uint (&places)[1024], const device Pairs& Pairs_1, const device Counts& Counts_1, device PairsOut& PairsOut_1)
{
    uint lane = thread0.x;
    uint begin = min(((group.x * 1024u) + (lane * 16u)), constants.count);
    uint end = min((begin + 16u), constants.count);
    for (uint d = 0u; d < 16u; d++)
    {
        places[(d * 64u) + lane] = 0u;
    }
    for (uint i = begin; i < end; i++)
    {
        uint param = ((device uint*)&Pairs_1._data[i])[0u];
        uint param_1 = constants.shift;
        uint _103 = (sort_digit(param, param_1) * 64u) + lane;
        places[_103]++;
    }
    threadgroup_barrier(mem_flags::mem_threadgroup);
    if (lane < 16u)
    {
        uint place = Counts_1._data[(lane * constants.groups) + group.x];
        for (uint other = 0u; other < 64u; other++)
        {
            uint at = (lane * 64u) + other;
            uint own = places[at];
            places[at] = place;
            place += own;
        }
    }
    threadgroup_barrier(mem_flags::mem_threadgroup);
    for (uint j = begin; j < end; j++)
    {
        uint2 pair = Pairs_1._data[j];
        uint param_2 = pair.x;
        uint param_3 = constants.shift;
        uint at_1 = (sort_digit(param_2, param_3) * 64u) + lane;
        PairsOut_1._data[places[at_1]] = pair;
        places[at_1]++;
    }
}

kernel void sort_scatter(const device Pairs& Pairs_1 [[buffer(0)]], const device Counts& Counts_1 [[buffer(1)]], device PairsOut& PairsOut_1 [[buffer(2)]], constant SortScatterConstants& constants [[buffer(8)]], uint3 gl_WorkGroupID [[threadgroup_position_in_grid]], uint3 gl_LocalInvocationID [[thread_position_in_threadgroup]])
{
    threadgroup uint places[1024];
    uint3 group = gl_WorkGroupID;
    uint3 thread0 = gl_LocalInvocationID;
    uint3 param = group;
    uint3 param_1 = thread0;
    _sort_scatter(param, param_1, constants, places, Pairs_1, Counts_1, PairsOut_1);
}

