// Generated from hlsl/sort_scan.hlsl, entry sort_scan, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct SortScanConstants
{
    uint total;
};

struct Counts
{
    uint _data[1];
};

static inline __attribute__((always_inline))
void _sort_scan(thread const uint3& thread0, constant SortScanConstants& constants, device Counts& Counts_1, threadgroup uint (&sums)[128])
{
    uint lane = thread0.x;
    uint share = ((constants.total + 128u) - 1u) / 128u;
    uint begin = min((lane * share), constants.total);
    uint end = min((begin + share), constants.total);
    uint sum = 0u;
    for (uint i = begin; i < end; i++)
    {
        sum += Counts_1._data[i];
    }
    sums[lane] = sum;
    threadgroup_barrier(mem_flags::mem_threadgroup);
    if (lane == 0u)
    {
        uint before = 0u;
        for (uint other = 0u; other < 128u; other++)
        {
            uint own = sums[other];
            sums[other] = before;
            before += own;
        }
    }
    threadgroup_barrier(mem_flags::mem_threadgroup);
    uint place = sums[lane];
    for (uint j = begin; j < end; j++)
    {
        uint own_1 = Counts_1._data[j];
        Counts_1._data[j] = place;
        place += own_1;
    }
}

kernel void sort_scan(device Counts& Counts_1 [[buffer(0)]], constant SortScanConstants& constants [[buffer(8)]], uint3 gl_LocalInvocationID [[thread_position_in_threadgroup]])
{
    threadgroup uint sums[128];
    uint3 thread0 = gl_LocalInvocationID;
    uint3 param = thread0;
    _sort_scan(param, constants, Counts_1, sums);
}

