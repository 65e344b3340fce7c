#version 310 es
// Generated from hlsl/shadow_clear.hlsl, entry shadow_clear, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

layout(binding = 8, std140) uniform ShadowClearConstants
{
    uint texels;
} constants;

layout(binding = 0, std430) buffer Shadow
{
    uint _data[];
} Shadow_1;

void _shadow_clear(uvec3 id)
{
    if (id.x < constants.texels)
    {
        Shadow_1._data[id.x] = 2130706432u;
    }
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _shadow_clear(param);
}

