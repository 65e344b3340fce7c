#version 310 es
// Generated from hlsl/sort_scatter.hlsl, entry sort_scatter, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

layout(binding = 8, std140) uniform SortScatterConstants
{
    uint count;
    uint groups;
    uint shift;
} constants;

layout(binding = 0, std430) readonly buffer Pairs
{
    uvec2 _data[];
} Pairs_1;

layout(binding = 1, std430) readonly buffer Counts
{
    uint _data[];
} Counts_1;

layout(binding = 2, std430) buffer PairsOut
{
    uvec2 _data[];
} PairsOut_1;

shared uint places[1024];

uint sort_digit(uint key, uint shift)
{
    return (key >> shift) & 15u;
}

void _sort_scatter(uvec3 group, uvec3 thread)
{
    uint lane = thread.x;
    uint begin = min(((group.x * 1024u) + (lane * 16u)), constants.count);
    uint end = min((begin + 16u), constants.count);
    for (uint d = 0u; d < 16u; d++)
    {
        places[(d * 64u) + lane] = 0u;
    }
    for (uint i = begin; i < end; i++)
    {
        uint param = Pairs_1._data[i].x;
        uint param_1 = constants.shift;
        uint _103 = (sort_digit(param, param_1) * 64u) + lane;
        places[_103]++;
    }
    barrier();
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
    barrier();
    for (uint j = begin; j < end; j++)
    {
        uvec2 pair = Pairs_1._data[j];
        uint param_2 = pair.x;
        uint param_3 = constants.shift;
        uint at_1 = (sort_digit(param_2, param_3) * 64u) + lane;
        PairsOut_1._data[places[at_1]] = pair;
        places[at_1]++;
    }
}

void main()
{
    uvec3 group = gl_WorkGroupID;
    uvec3 thread = gl_LocalInvocationID;
    uvec3 param = group;
    uvec3 param_1 = thread;
    _sort_scatter(param, param_1);
}

