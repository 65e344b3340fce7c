#version 310 es
// Generated from hlsl/activate.hlsl, entry activate, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

layout(binding = 8, std140) uniform ActivateConstants
{
    uint count;
} constants;

layout(binding = 0, std430) buffer Splats
{
    vec4 _data[];
} Splats_1;

float activate_opacity(float opacity_logit)
{
    float e = exp(-abs(opacity_logit));
    return ((opacity_logit >= 0.0) ? 1.0 : e) / (1.0 + e);
}

vec4 activate_quat(vec4 quat_wxyz)
{
    return quat_wxyz / vec4(max(sqrt(dot(quat_wxyz, quat_wxyz)), 9.9999999600419720025001879548654e-13));
}

vec3 activate_scale(vec3 log_scale)
{
    return exp(log_scale);
}

void _activate(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    vec4 mean = Splats_1._data[row];
    float param = mean.w;
    Splats_1._data[row] = vec4(mean.xyz, activate_opacity(param));
    vec4 param_1 = Splats_1._data[constants.count + row];
    Splats_1._data[constants.count + row] = activate_quat(param_1);
    vec4 row0 = Splats_1._data[(2u * constants.count) + row];
    vec4 row1 = Splats_1._data[(3u * constants.count) + row];
    vec4 row2 = Splats_1._data[(4u * constants.count) + row];
    vec3 param_2 = vec3(row0.w, row1.w, row2.w);
    vec3 scale = activate_scale(param_2);
    Splats_1._data[(2u * constants.count) + row] = vec4(row0.xyz, scale.x);
    Splats_1._data[(3u * constants.count) + row] = vec4(row1.xyz, scale.y);
    Splats_1._data[(4u * constants.count) + row] = vec4(row2.xyz, scale.z);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _activate(param);
}

