#version 310 es
// Generated from hlsl/sort_count.hlsl, entry sort_count, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

layout(binding = 8, std140) uniform SortCountConstants
{
    uint count;
    uint groups;
    uint shift;
} constants;

layout(binding = 0, std430) readonly buffer Pairs
{
    uvec2 _data[];
} Pairs_1;

layout(binding = 1, std430) buffer Counts
{
    uint _data[];
} Counts_1;

shared uint occurrences[16];

uint sort_digit(uint key, uint shift)
{
    return (key >> shift) & 15u;
}

void _sort_count(uvec3 group, uvec3 thread)
{
    uint lane = thread.x;
    if (lane < 16u)
    {
        occurrences[lane] = 0u;
    }
    barrier();
    for (uint i = 0u; i < 16u; i++)
    {
        uint at = ((group.x * 1024u) + (i * 64u)) + lane;
        if (at < constants.count)
        {
            uint param = Pairs_1._data[at].x;
            uint param_1 = constants.shift;
            uint _92 = atomicAdd(occurrences[sort_digit(param, param_1)], 1u);
        }
    }
    barrier();
    if (lane < 16u)
    {
        Counts_1._data[(lane * constants.groups) + group.x] = occurrences[lane];
    }
}

void main()
{
    uvec3 group = gl_WorkGroupID;
    uvec3 thread = gl_LocalInvocationID;
    uvec3 param = group;
    uvec3 param_1 = thread;
    _sort_count(param, param_1);
}

