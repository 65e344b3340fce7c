// Generated from hlsl/sort_count.hlsl, entry sort_count, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"
#pragma clang diagnostic ignored "-Wunused-variable"

#include <metal_stdlib>
#include <simd/simd.h>
#include <metal_atomic>

using namespace metal;

struct SortCountConstants
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

static inline __attribute__((always_inline))
uint sort_digit(thread const uint& key, thread const uint& shift)
{
    return (key >> shift) & 15u;
}

static inline __attribute__((always_inline))
void _sort_count(thread const uint3& group, thread const uint3& thread0, threadgroup uint (&occurrences)[16], constant SortCountConstants& constants, const device Pairs& Pairs_1, device Counts& Counts_1)
{
    uint lane = thread0.x;
    if (lane < 16u)
    {
        occurrences[lane] = 0u;
    }
    threadgroup_barrier(mem_flags::mem_threadgroup);
    for (uint i = 0u; i < 16u; i++)
    {
        uint at = ((group.x * 1024u) + (i * 64u)) + lane;
        if (at < constants.count)
        {
            uint param = ((device uint*)&Pairs_1._data[at])[0u];
            uint param_1 = constants.shift;
            uint _92 = atomic_fetch_add_explicit((threadgroup atomic_uint*)&occurrences[sort_digit(param, param_1)], 1u, memory_order_relaxed);
        }
    }
    threadgroup_barrier(mem_flags::mem_threadgroup);
    if (lane < 16u)
    {
        Counts_1._data[(lane * constants.groups) + group.x] = occurrences[lane];
    }
}

kernel void sort_count(const device Pairs& Pairs_1 [[buffer(0)]], device Counts& Counts_1 [[buffer(1)]], constant SortCountConstants& constants [[buffer(8)]], uint3 gl_WorkGroupID [[threadgroup_position_in_grid]], uint3 gl_LocalInvocationID [[thread_position_in_threadgroup]])
{
    threadgroup uint occurrences[16];
    uint3 group = gl_WorkGroupID;
    uint3 thread0 = gl_LocalInvocationID;
    uint3 param = group;
    uint3 param_1 = thread0;
    _sort_count(param, param_1, occurrences, constants, Pairs_1, Counts_1);
}

