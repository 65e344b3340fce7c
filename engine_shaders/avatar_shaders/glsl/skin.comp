#version 310 es
// Generated from hlsl/skin.hlsl, entry skin, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

struct Rows4
{
    vec4 row0;
    vec4 row1;
    vec4 row2;
};

layout(binding = 0, std430) readonly buffer SkinStatic
{
    uint _data[];
} SkinStatic_1;

layout(binding = 8, std140) uniform SkinConstants
{
    uint first;
    uint count;
    uint late_ptr;
    uint late_column;
    uint late_column_width;
    uint late_position;
    uint late_position_width;
    uint late_position_step;
    uint skin_ptr;
    uint skin_column;
    uint skin_column_width;
    uint skin_weight;
    uint skin_weight_width;
    uint skin_weight_step;
    uint late;
    uint joints;
} constants;

layout(binding = 1, std430) readonly buffer Pose
{
    float _data[];
} Pose_1;

layout(binding = 2, std430) buffer Mesh
{
    vec4 _data[];
} Mesh_1;

Rows4 skin_none()
{
    Rows4 sum;
    sum.row0 = vec4(0.0);
    sum.row1 = vec4(0.0);
    sum.row2 = vec4(0.0);
    return sum;
}

uint packed_element(uint word, uint bit, uint width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

uint skinned_code(uint section, uint index, uint width)
{
    if (width == 32u)
    {
        return SkinStatic_1._data[section + index];
    }
    uint bit = index * width;
    uint param = SkinStatic_1._data[section + (bit >> uint(5))];
    uint param_1 = bit;
    uint param_2 = width;
    return packed_element(param, param_1, param_2);
}

float skinned_weight(uint section, uint index, uint width, uint _step)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = skinned_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    return uintBitsToFloat(SkinStatic_1._data[_step]) * float(code);
}

Rows4 skin_joint(uint joint)
{
    uint at = constants.joints + (12u * joint);
    Rows4 m;
    m.row0 = vec4(Pose_1._data[at], Pose_1._data[at + 1u], Pose_1._data[at + 2u], Pose_1._data[at + 3u]);
    m.row1 = vec4(Pose_1._data[at + 4u], Pose_1._data[at + 5u], Pose_1._data[at + 6u], Pose_1._data[at + 7u]);
    m.row2 = vec4(Pose_1._data[at + 8u], Pose_1._data[at + 9u], Pose_1._data[at + 10u], Pose_1._data[at + 11u]);
    return m;
}

Rows4 skin_add(inout Rows4 sum, float weight, Rows4 joint)
{
    sum.row0 += (joint.row0 * weight);
    sum.row1 += (joint.row1 * weight);
    sum.row2 += (joint.row2 * weight);
    return sum;
}

vec3 transform_point(Rows4 m, vec3 p)
{
    return vec3((((m.row0.x * p.x) + (m.row0.y * p.y)) + (m.row0.z * p.z)) + m.row0.w, (((m.row1.x * p.x) + (m.row1.y * p.y)) + (m.row1.z * p.z)) + m.row1.w, (((m.row2.x * p.x) + (m.row2.y * p.y)) + (m.row2.z * p.z)) + m.row2.w);
}

float packed_step_count(uint code, uint width)
{
    return float(code) - float(1u << (width - 1u));
}

float skinned_signed(uint section, uint index, uint width, uint _step)
{
    if (width == 0u)
    {
        return 0.0;
    }
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = skinned_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    uint param_3 = code;
    uint param_4 = width;
    return uintBitsToFloat(SkinStatic_1._data[_step]) * packed_step_count(param_3, param_4);
}

vec3 skinned_signed3(uint section, uint index, uint width, uint _step)
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
    return vec3(skinned_signed(param, param_1, param_2, param_3), skinned_signed(param_4, param_5, param_6, param_7), skinned_signed(param_8, param_9, param_10, param_11));
}

vec3 late_add(vec3 posed, float weight, vec3 delta)
{
    return posed + (delta * weight);
}

void _skin(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    Rows4 blended = skin_none();
    uint end = SkinStatic_1._data[(constants.skin_ptr + row) + 1u];
    uint _448 = constants.skin_ptr + row;
    for (uint e = SkinStatic_1._data[_448]; e < end; e++)
    {
        uint param = constants.skin_weight;
        uint param_1 = e;
        uint param_2 = constants.skin_weight_width;
        uint param_3 = constants.skin_weight_step;
        float weight = skinned_weight(param, param_1, param_2, param_3);
        uint param_4 = constants.skin_column;
        uint param_5 = e;
        uint param_6 = constants.skin_column_width;
        uint param_7 = skinned_code(param_4, param_5, param_6);
        Rows4 param_8 = blended;
        float param_9 = weight;
        Rows4 param_10 = skin_joint(param_7);
        Rows4 _493 = skin_add(param_8, param_9, param_10);
        blended = _493;
    }
    Rows4 param_11 = blended;
    vec3 param_12 = Mesh_1._data[constants.first + row].xyz;
    vec3 posed = transform_point(param_11, param_12);
    uint late_end = SkinStatic_1._data[(constants.late_ptr + row) + 1u];
    uint _525 = constants.late_ptr + row;
    for (uint l = SkinStatic_1._data[_525]; l < late_end; l++)
    {
        uint param_13 = constants.late_column;
        uint param_14 = l;
        uint param_15 = constants.late_column_width;
        uint column = skinned_code(param_13, param_14, param_15);
        uint param_16 = constants.late_position;
        uint param_17 = 3u * l;
        uint param_18 = constants.late_position_width;
        uint param_19 = constants.late_position_step + (3u * column);
        vec3 delta = skinned_signed3(param_16, param_17, param_18, param_19);
        vec3 param_20 = posed;
        float param_21 = Pose_1._data[constants.late + column];
        vec3 param_22 = delta;
        posed = late_add(param_20, param_21, param_22);
    }
    Mesh_1._data[constants.first + row] = vec4(posed, 1.0);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _skin(param);
}

