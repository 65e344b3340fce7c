#version 310 es
// Generated from hlsl/morph.hlsl, entry morph, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

layout(binding = 0, std430) readonly buffer MorphStatic
{
    uint _data[];
} MorphStatic_1;

layout(binding = 8, std140) uniform MorphConstants
{
    uint first;
    uint count;
    uint vertices;
    uint template_position;
    uint template_position_width;
    uint template_position_scale;
    uint morph_ptr;
    uint morph_column;
    uint morph_column_width;
    uint morph_position;
    uint morph_position_width;
    uint morph_position_step;
    uint corrective_ptr;
    uint corrective_column;
    uint corrective_column_width;
    uint corrective_position;
    uint corrective_position_width;
    uint corrective_position_step;
    uint weights;
    uint features;
} constants;

layout(binding = 1, std430) readonly buffer Pose
{
    float _data[];
} Pose_1;

layout(binding = 2, std430) buffer Mesh
{
    vec4 _data[];
} Mesh_1;

uint packed_element(uint word, uint bit, uint width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

uint morph_code(uint section, uint index, uint width)
{
    if (width == 32u)
    {
        return MorphStatic_1._data[section + index];
    }
    uint bit = index * width;
    uint param = MorphStatic_1._data[section + (bit >> uint(5))];
    uint param_1 = bit;
    uint param_2 = width;
    return packed_element(param, param_1, param_2);
}

float morph_linear(uint section, uint index, uint width, uint scale)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = morph_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    return uintBitsToFloat(MorphStatic_1._data[scale]) + (uintBitsToFloat(MorphStatic_1._data[scale + 1u]) * float(code));
}

vec3 morph_linear3(uint section, uint index, uint stride, uint width, uint scale)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint param_3 = scale;
    uint param_4 = section;
    uint param_5 = index + stride;
    uint param_6 = width;
    uint param_7 = scale + 2u;
    uint param_8 = section;
    uint param_9 = index + (2u * stride);
    uint param_10 = width;
    uint param_11 = scale + 4u;
    return vec3(morph_linear(param, param_1, param_2, param_3), morph_linear(param_4, param_5, param_6, param_7), morph_linear(param_8, param_9, param_10, param_11));
}

float packed_step_count(uint code, uint width)
{
    return float(code) - float(1u << (width - 1u));
}

float morph_signed(uint section, uint index, uint width, uint _step)
{
    if (width == 0u)
    {
        return 0.0;
    }
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = morph_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    uint param_3 = code;
    uint param_4 = width;
    return uintBitsToFloat(MorphStatic_1._data[_step]) * packed_step_count(param_3, param_4);
}

vec3 morph_signed3(uint section, uint index, uint width, uint _step)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint param_3 = _step;
    uint param_4 = section;
    uint param_5 = index + 1u;
    uint param_6 = width;
    uint param_7 = _step + 1u;
    uint param_8 = section;
    uint param_9 = index + 2u;
    uint param_10 = width;
    uint param_11 = _step + 2u;
    return vec3(morph_signed(param, param_1, param_2, param_3), morph_signed(param_4, param_5, param_6, param_7), morph_signed(param_8, param_9, param_10, param_11));
}

vec3 morph_add(vec3 position, float weight, vec3 delta)
{
    return position + (delta * weight);
}

vec3 morphed(inout vec3 position, uint row)
{
    uint end = MorphStatic_1._data[(constants.morph_ptr + row) + 1u];
    uint _296 = constants.morph_ptr + row;
    for (uint e = MorphStatic_1._data[_296]; e < end; e++)
    {
        uint param = constants.morph_column;
        uint param_1 = e;
        uint param_2 = constants.morph_column_width;
        uint column = morph_code(param, param_1, param_2);
        float weight = Pose_1._data[constants.weights + column];
        if (weight != 0.0)
        {
            uint _step = constants.morph_position_step + (3u * column);
            uint param_3 = constants.morph_position;
            uint param_4 = 3u * e;
            uint param_5 = constants.morph_position_width;
            uint param_6 = _step;
            vec3 param_7 = position;
            float param_8 = weight;
            vec3 param_9 = morph_signed3(param_3, param_4, param_5, param_6);
            position = morph_add(param_7, param_8, param_9);
        }
    }
    return position;
}

vec3 corrected(inout vec3 position, uint row)
{
    uint end = MorphStatic_1._data[(constants.corrective_ptr + row) + 1u];
    uint _383 = constants.corrective_ptr + row;
    for (uint e = MorphStatic_1._data[_383]; e < end; e++)
    {
        uint param = constants.corrective_column;
        uint param_1 = e;
        uint param_2 = constants.corrective_column_width;
        uint column = morph_code(param, param_1, param_2);
        float feature = Pose_1._data[constants.features + column];
        if (feature != 0.0)
        {
            uint _step = constants.corrective_position_step + (3u * column);
            uint param_3 = constants.corrective_position;
            uint param_4 = 3u * e;
            uint param_5 = constants.corrective_position_width;
            uint param_6 = _step;
            vec3 param_7 = position;
            float param_8 = feature;
            vec3 param_9 = morph_signed3(param_3, param_4, param_5, param_6);
            position = morph_add(param_7, param_8, param_9);
        }
    }
    return position;
}

void _morph(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    uint param = constants.template_position;
    uint param_1 = row;
    uint param_2 = constants.count;
    uint param_3 = constants.template_position_width;
    uint param_4 = constants.template_position_scale;
    vec3 position = morph_linear3(param, param_1, param_2, param_3, param_4);
    vec3 param_5 = position;
    uint param_6 = row;
    vec3 _491 = morphed(param_5, param_6);
    vec3 param_7 = _491;
    uint param_8 = row;
    vec3 _495 = corrected(param_7, param_8);
    Mesh_1._data[constants.first + row] = vec4(_495, 1.0);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _morph(param);
}

