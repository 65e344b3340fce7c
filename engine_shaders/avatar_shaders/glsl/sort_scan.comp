#version 310 es
// Generated from hlsl/sort_scan.hlsl, entry sort_scan, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 128, local_size_y = 1, local_size_z = 1) in;

layout(binding = 8, std140) uniform SortScanConstants
{
    uint total;
} constants;

layout(binding = 0, std430) buffer Counts
{
    uint _data[];
} Counts_1;

shared uint sums[128];

void _sort_scan(uvec3 thread)
{
    uint lane = thread.x;
    uint share = ((constants.total + 128u) - 1u) / 128u;
    uint begin = min((lane * share), constants.total);
    uint end = min((begin + share), constants.total);
    uint sum = 0u;
    for (uint i = begin; i < end; i++)
    {
        sum += Counts_1._data[i];
    }
    sums[lane] = sum;
    barrier();
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
    barrier();
    uint place = sums[lane];
    for (uint j = begin; j < end; j++)
    {
        uint own_1 = Counts_1._data[j];
        Counts_1._data[j] = place;
        place += own_1;
    }
}

void main()
{
    uvec3 thread = gl_LocalInvocationID;
    uvec3 param = thread;
    _sort_scan(param);
}

