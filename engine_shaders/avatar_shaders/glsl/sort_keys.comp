#version 310 es
// Generated from hlsl/sort_keys.hlsl, entry sort_keys, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

layout(binding = 8, std140) uniform SortKeysConstants
{
    uint count;
    uint first;
} constants;

layout(binding = 1, std430) buffer Pairs
{
    uvec2 _data[];
} Pairs_1;

layout(binding = 0, std430) readonly buffer Projected
{
    vec4 _data[];
} Projected_1;

uint sort_key(float depth, float radius)
{
    return (radius > 0.0) ? floatBitsToUint(depth) : 4294967295u;
}

void _sort_keys(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    float param = Projected_1._data[row].z;
    float param_1 = Projected_1._data[constants.count + row].w;
    Pairs_1._data[constants.first + row] = uvec2(sort_key(param, param_1), constants.first + row);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _sort_keys(param);
}

