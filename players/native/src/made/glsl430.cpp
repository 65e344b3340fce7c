// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.
#include "shader_texts.h"

namespace avatar {

const ShaderText glsl430_texts[] = {
{"morph", R"~(#version 430
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

)~"},
{"skin", R"~(#version 430
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

)~"},
{"blend", R"~(#version 430
// Generated from hlsl/blend.hlsl, entry blend, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

struct BlendGeometry
{
    vec3 mean;
    vec4 quat_wxyz;
};

struct BlendAppearance
{
    vec3 log_scale;
    float opacity_logit;
};

layout(binding = 0, std430) readonly buffer BlendStatic
{
    uint _data[];
} BlendStatic_1;

layout(binding = 8, std140) uniform BlendConstants
{
    uint count;
    uint sh_terms;
    uint weights;
    uint base_mean;
    uint base_mean_width;
    uint base_mean_scale;
    uint base_log_scale;
    uint base_log_scale_width;
    uint base_log_scale_scale;
    uint base_quat;
    uint base_quat_width;
    uint base_quat_scale;
    uint base_opacity;
    uint base_opacity_width;
    uint base_opacity_table;
    uint base_sh;
    uint base_sh_width;
    uint base_sh_scale;
    uint geometry_ptr;
    uint geometry_column;
    uint geometry_column_width;
    uint geometry_mean;
    uint geometry_mean_width;
    uint geometry_mean_step;
    uint geometry_quat;
    uint geometry_quat_width;
    uint geometry_quat_step;
    uint appearance_ptr;
    uint appearance_column;
    uint appearance_column_width;
    uint appearance_log_scale;
    uint appearance_log_scale_width;
    uint appearance_log_scale_step;
    uint appearance_opacity;
    uint appearance_opacity_width;
    uint appearance_opacity_step;
    uint appearance_sh;
    uint appearance_sh_width;
    uint appearance_sh_step;
    uint unused;
} constants;

layout(binding = 1, std430) readonly buffer Pose
{
    float _data[];
} Pose_1;

layout(binding = 3, std430) buffer Sh
{
    float _data[];
} Sh_1;

layout(binding = 2, std430) buffer Splats
{
    vec4 _data[];
} Splats_1;

uint packed_element(uint word, uint bit, uint width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

uint blend_code(uint section, uint index, uint width)
{
    if (width == 32u)
    {
        return BlendStatic_1._data[section + index];
    }
    uint bit = index * width;
    uint param = BlendStatic_1._data[section + (bit >> uint(5))];
    uint param_1 = bit;
    uint param_2 = width;
    return packed_element(param, param_1, param_2);
}

float blend_linear(uint section, uint index, uint width, uint scale)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = blend_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    return uintBitsToFloat(BlendStatic_1._data[scale]) + (uintBitsToFloat(BlendStatic_1._data[scale + 1u]) * float(code));
}

vec3 blend_linear3(uint section, uint index, uint stride, uint width, uint scale)
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
    return vec3(blend_linear(param, param_1, param_2, param_3), blend_linear(param_4, param_5, param_6, param_7), blend_linear(param_8, param_9, param_10, param_11));
}

float packed_step_count(uint code, uint width)
{
    return float(code) - float(1u << (width - 1u));
}

float blend_signed(uint section, uint index, uint width, uint _step)
{
    if (width == 0u)
    {
        return 0.0;
    }
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = blend_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    uint param_3 = code;
    uint param_4 = width;
    return uintBitsToFloat(BlendStatic_1._data[_step]) * packed_step_count(param_3, param_4);
}

vec3 blend_signed3(uint section, uint index, uint width, uint _step)
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
    return vec3(blend_signed(param, param_1, param_2, param_3), blend_signed(param_4, param_5, param_6, param_7), blend_signed(param_8, param_9, param_10, param_11));
}

BlendGeometry blend_geometry(inout BlendGeometry g, float weight, vec3 mean, vec4 quat_wxyz)
{
    g.mean += (mean * weight);
    g.quat_wxyz += (quat_wxyz * weight);
    return g;
}

BlendGeometry blended_geometry(uint row)
{
    uint param = constants.base_mean;
    uint param_1 = row;
    uint param_2 = constants.count;
    uint param_3 = constants.base_mean_width;
    uint param_4 = constants.base_mean_scale;
    BlendGeometry g;
    g.mean = blend_linear3(param, param_1, param_2, param_3, param_4);
    uint param_5 = constants.base_quat;
    uint param_6 = row;
    uint param_7 = constants.base_quat_width;
    uint param_8 = constants.base_quat_scale;
    uint param_9 = constants.base_quat;
    uint param_10 = constants.count + row;
    uint param_11 = constants.count;
    uint param_12 = constants.base_quat_width;
    uint param_13 = constants.base_quat_scale + 2u;
    g.quat_wxyz = vec4(blend_linear(param_5, param_6, param_7, param_8), blend_linear3(param_9, param_10, param_11, param_12, param_13));
    uint end = BlendStatic_1._data[(constants.geometry_ptr + row) + 1u];
    uint _481 = constants.geometry_ptr + row;
    for (uint e = BlendStatic_1._data[_481]; e < end; e++)
    {
        uint param_14 = constants.geometry_column;
        uint param_15 = e;
        uint param_16 = constants.geometry_column_width;
        uint column = blend_code(param_14, param_15, param_16);
        float weight = Pose_1._data[constants.weights + column];
        if (weight != 0.0)
        {
            uint param_17 = constants.geometry_mean;
            uint param_18 = 3u * e;
            uint param_19 = constants.geometry_mean_width;
            uint param_20 = constants.geometry_mean_step + (3u * column);
            vec3 mean = blend_signed3(param_17, param_18, param_19, param_20);
            uint _step = constants.geometry_quat_step + (4u * column);
            uint param_21 = constants.geometry_quat;
            uint param_22 = 4u * e;
            uint param_23 = constants.geometry_quat_width;
            uint param_24 = _step;
            uint param_25 = constants.geometry_quat;
            uint param_26 = (4u * e) + 1u;
            uint param_27 = constants.geometry_quat_width;
            uint param_28 = _step + 1u;
            vec4 quat_wxyz = vec4(blend_signed(param_21, param_22, param_23, param_24), blend_signed3(param_25, param_26, param_27, param_28));
            BlendGeometry param_29 = g;
            float param_30 = weight;
            vec3 param_31 = mean;
            vec4 param_32 = quat_wxyz;
            BlendGeometry _590 = blend_geometry(param_29, param_30, param_31, param_32);
            g = _590;
        }
    }
    return g;
}

float blend_table(uint section, uint index, uint width, uint table)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = blend_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    return uintBitsToFloat(BlendStatic_1._data[table + code]);
}

BlendAppearance blend_appearance(inout BlendAppearance a, float weight, vec3 log_scale, float opacity_logit)
{
    a.log_scale += (log_scale * weight);
    a.opacity_logit += (weight * opacity_logit);
    return a;
}

BlendAppearance blended_appearance(uint row)
{
    uint param = constants.base_log_scale;
    uint param_1 = row;
    uint param_2 = constants.count;
    uint param_3 = constants.base_log_scale_width;
    uint param_4 = constants.base_log_scale_scale;
    BlendAppearance a;
    a.log_scale = blend_linear3(param, param_1, param_2, param_3, param_4);
    uint param_5 = constants.base_opacity;
    uint param_6 = row;
    uint param_7 = constants.base_opacity_width;
    uint param_8 = constants.base_opacity_table;
    a.opacity_logit = blend_table(param_5, param_6, param_7, param_8);
    uint end = BlendStatic_1._data[(constants.appearance_ptr + row) + 1u];
    uint _645 = constants.appearance_ptr + row;
    for (uint e = BlendStatic_1._data[_645]; e < end; e++)
    {
        uint param_9 = constants.appearance_column;
        uint param_10 = e;
        uint param_11 = constants.appearance_column_width;
        uint column = blend_code(param_9, param_10, param_11);
        float weight = Pose_1._data[constants.weights + column];
        if (weight != 0.0)
        {
            uint param_12 = constants.appearance_log_scale;
            uint param_13 = 3u * e;
            uint param_14 = constants.appearance_log_scale_width;
            uint param_15 = constants.appearance_log_scale_step + (3u * column);
            vec3 log_scale = blend_signed3(param_12, param_13, param_14, param_15);
            uint param_16 = constants.appearance_opacity;
            uint param_17 = e;
            uint param_18 = constants.appearance_opacity_width;
            uint param_19 = constants.appearance_opacity_step + column;
            float opacity_logit = blend_signed(param_16, param_17, param_18, param_19);
            BlendAppearance param_20 = a;
            float param_21 = weight;
            vec3 param_22 = log_scale;
            float param_23 = opacity_logit;
            BlendAppearance _725 = blend_appearance(param_20, param_21, param_22, param_23);
            a = _725;
        }
    }
    return a;
}

vec3 blend_base_sh(uint t, uint row)
{
    uint param = constants.base_sh;
    uint param_1 = (t * constants.count) + row;
    uint param_2 = constants.count;
    uint param_3 = constants.base_sh_width;
    uint param_4 = constants.base_sh_scale + (2u * t);
    return blend_linear3(param, param_1, param_2, param_3, param_4);
}

vec3 blend_sh(vec3 coefficient, float weight, vec3 delta)
{
    return coefficient + (delta * weight);
}

void blend_store_sh(uint k, uint row, vec3 coefficient)
{
    if (k < constants.sh_terms)
    {
        uint at = ((3u * k) * constants.count) + row;
        Sh_1._data[at] = coefficient.x;
        Sh_1._data[at + constants.count] = coefficient.y;
        Sh_1._data[at + (2u * constants.count)] = coefficient.z;
    }
}

void blend_sh_from(uint k, uint row)
{
    uint last = constants.sh_terms - 1u;
    uint terms = 3u * constants.sh_terms;
    uint t0 = 3u * k;
    uint t1 = 3u * min((k + 1u), last);
    uint t2 = 3u * min((k + 2u), last);
    uint t3 = 3u * min((k + 3u), last);
    uint param = t0;
    uint param_1 = row;
    vec3 c0 = blend_base_sh(param, param_1);
    uint param_2 = t1;
    uint param_3 = row;
    vec3 c1 = blend_base_sh(param_2, param_3);
    uint param_4 = t2;
    uint param_5 = row;
    vec3 c2 = blend_base_sh(param_4, param_5);
    uint param_6 = t3;
    uint param_7 = row;
    vec3 c3 = blend_base_sh(param_6, param_7);
    uint end = BlendStatic_1._data[(constants.appearance_ptr + row) + 1u];
    if (constants.appearance_sh_width == 0u)
    {
        end = 0u;
    }
    uint _839 = constants.appearance_ptr + row;
    for (uint e = BlendStatic_1._data[_839]; e < end; e++)
    {
        uint param_8 = constants.appearance_column;
        uint param_9 = e;
        uint param_10 = constants.appearance_column_width;
        uint column = blend_code(param_8, param_9, param_10);
        float weight = Pose_1._data[constants.weights + column];
        if (weight != 0.0)
        {
            uint at = terms * e;
            uint _step = constants.appearance_sh_step + (terms * column);
            uint param_11 = constants.appearance_sh;
            uint param_12 = at + t0;
            uint param_13 = constants.appearance_sh_width;
            uint param_14 = _step + t0;
            vec3 p)~"
R"~(aram_15 = c0;
            float param_16 = weight;
            vec3 param_17 = blend_signed3(param_11, param_12, param_13, param_14);
            c0 = blend_sh(param_15, param_16, param_17);
            uint param_18 = constants.appearance_sh;
            uint param_19 = at + t1;
            uint param_20 = constants.appearance_sh_width;
            uint param_21 = _step + t1;
            vec3 param_22 = c1;
            float param_23 = weight;
            vec3 param_24 = blend_signed3(param_18, param_19, param_20, param_21);
            c1 = blend_sh(param_22, param_23, param_24);
            uint param_25 = constants.appearance_sh;
            uint param_26 = at + t2;
            uint param_27 = constants.appearance_sh_width;
            uint param_28 = _step + t2;
            vec3 param_29 = c2;
            float param_30 = weight;
            vec3 param_31 = blend_signed3(param_25, param_26, param_27, param_28);
            c2 = blend_sh(param_29, param_30, param_31);
            uint param_32 = constants.appearance_sh;
            uint param_33 = at + t3;
            uint param_34 = constants.appearance_sh_width;
            uint param_35 = _step + t3;
            vec3 param_36 = c3;
            float param_37 = weight;
            vec3 param_38 = blend_signed3(param_32, param_33, param_34, param_35);
            c3 = blend_sh(param_36, param_37, param_38);
        }
    }
    uint param_39 = k;
    uint param_40 = row;
    vec3 param_41 = c0;
    blend_store_sh(param_39, param_40, param_41);
    uint param_42 = k + 1u;
    uint param_43 = row;
    vec3 param_44 = c1;
    blend_store_sh(param_42, param_43, param_44);
    uint param_45 = k + 2u;
    uint param_46 = row;
    vec3 param_47 = c2;
    blend_store_sh(param_45, param_46, param_47);
    uint param_48 = k + 3u;
    uint param_49 = row;
    vec3 param_50 = c3;
    blend_store_sh(param_48, param_49, param_50);
}

void _blend(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    uint param = row;
    BlendGeometry g = blended_geometry(param);
    uint param_1 = row;
    BlendAppearance a = blended_appearance(param_1);
    Splats_1._data[row] = vec4(g.mean, a.opacity_logit);
    Splats_1._data[constants.count + row] = g.quat_wxyz;
    Splats_1._data[(2u * constants.count) + row] = vec4(1.0, 0.0, 0.0, a.log_scale.x);
    Splats_1._data[(3u * constants.count) + row] = vec4(0.0, 1.0, 0.0, a.log_scale.y);
    Splats_1._data[(4u * constants.count) + row] = vec4(0.0, 0.0, 1.0, a.log_scale.z);
    for (uint k = 0u; k < constants.sh_terms; k += 4u)
    {
        uint param_2 = k;
        uint param_3 = row;
        blend_sh_from(param_2, param_3);
    }
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _blend(param);
}

)~"},
{"bind_skin", R"~(#version 430
// Generated from hlsl/bind_skin.hlsl, entry bind_skin, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

struct Rows3
{
    vec3 row0;
    vec3 row1;
    vec3 row2;
};

struct Rows4
{
    vec4 row0;
    vec4 row1;
    vec4 row2;
};

struct BoundSplat
{
    vec3 mean;
    vec4 quat_wxyz;
    Rows3 sh_rotation;
};

layout(binding = 0, std430) readonly buffer BindStatic
{
    uint _data[];
} BindStatic_1;

layout(binding = 8, std140) uniform BindSkinConstants
{
    uint count;
    uint first;
    uint rows;
    uint corrective_ptr;
    uint corrective_column;
    uint corrective_column_width;
    uint corrective_mean;
    uint corrective_mean_width;
    uint corrective_mean_step;
    uint late_ptr;
    uint late_column;
    uint late_column_width;
    uint late_mean;
    uint late_mean_width;
    uint late_mean_step;
    uint skin_ptr;
    uint skin_column;
    uint skin_column_width;
    uint skin_weight;
    uint skin_weight_width;
    uint skin_weight_step;
    uint features;
    uint late;
    uint joints;
    uint binding_rule;
    uint rotation_rule;
    uint sh_direction;
    uint unused;
    vec4 group_matrix_row0;
    vec4 group_matrix_row1;
    vec4 group_matrix_row2;
    vec4 group_rotation_row0;
    vec4 group_rotation_row1;
    vec4 group_rotation_row2;
    vec4 world_row0;
    vec4 world_row1;
    vec4 world_row2;
    vec4 world_quat_wxyz;
} constants;

layout(binding = 1, std430) readonly buffer Pose
{
    float _data[];
} Pose_1;

layout(binding = 2, std430) buffer Splats
{
    vec4 _data[];
} Splats_1;

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

uint bind_code(uint section, uint index, uint width)
{
    if (width == 32u)
    {
        return BindStatic_1._data[section + index];
    }
    uint bit = index * width;
    uint param = BindStatic_1._data[section + (bit >> uint(5))];
    uint param_1 = bit;
    uint param_2 = width;
    return packed_element(param, param_1, param_2);
}

float bind_weight(uint section, uint index, uint width, uint _step)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = bind_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    return uintBitsToFloat(BindStatic_1._data[_step]) * float(code);
}

Rows4 skin_add(inout Rows4 sum, float weight, Rows4 joint)
{
    sum.row0 += (joint.row0 * weight);
    sum.row1 += (joint.row1 * weight);
    sum.row2 += (joint.row2 * weight);
    return sum;
}

Rows4 bind_skin_matrix(uint row)
{
    Rows4 blended = skin_none();
    uint end = BindStatic_1._data[(constants.skin_ptr + row) + 1u];
    uint _1022 = constants.skin_ptr + row;
    Rows4 m;
    for (uint e = BindStatic_1._data[_1022]; e < end; e++)
    {
        uint param = constants.skin_column;
        uint param_1 = e;
        uint param_2 = constants.skin_column_width;
        uint at = constants.joints + (12u * bind_code(param, param_1, param_2));
        m.row0 = vec4(Pose_1._data[at], Pose_1._data[at + 1u], Pose_1._data[at + 2u], Pose_1._data[at + 3u]);
        m.row1 = vec4(Pose_1._data[at + 4u], Pose_1._data[at + 5u], Pose_1._data[at + 6u], Pose_1._data[at + 7u]);
        m.row2 = vec4(Pose_1._data[at + 8u], Pose_1._data[at + 9u], Pose_1._data[at + 10u], Pose_1._data[at + 11u]);
        uint param_3 = constants.skin_weight;
        uint param_4 = e;
        uint param_5 = constants.skin_weight_width;
        uint param_6 = constants.skin_weight_step;
        Rows4 param_7 = blended;
        float param_8 = bind_weight(param_3, param_4, param_5, param_6);
        Rows4 param_9 = m;
        Rows4 _1133 = skin_add(param_7, param_8, param_9);
        blended = _1133;
    }
    return blended;
}

Rows3 linear_part(Rows4 m)
{
    Rows3 r;
    r.row0 = m.row0.xyz;
    r.row1 = m.row1.xyz;
    r.row2 = m.row2.xyz;
    return r;
}

Rows3 polar(inout Rows3 m)
{
    for (int _step = 0; _step < 3; _step++)
    {
        vec3 c0 = cross(m.row1, m.row2);
        vec3 c1 = cross(m.row2, m.row0);
        vec3 c2 = cross(m.row0, m.row1);
        float determinant = dot(m.row0, c0);
        m.row0 = (m.row0 + (c0 / vec3(determinant))) * 0.5;
        m.row1 = (m.row1 + (c1 / vec3(determinant))) * 0.5;
        m.row2 = (m.row2 + (c2 / vec3(determinant))) * 0.5;
    }
    return m;
}

float packed_step_count(uint code, uint width)
{
    return float(code) - float(1u << (width - 1u));
}

float bind_signed(uint section, uint index, uint width, uint _step)
{
    if (width == 0u)
    {
        return 0.0;
    }
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = bind_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    uint param_3 = code;
    uint param_4 = width;
    return uintBitsToFloat(BindStatic_1._data[_step]) * packed_step_count(param_3, param_4);
}

vec3 bind_signed3(uint section, uint index, uint width, uint _step)
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
    return vec3(bind_signed(param, param_1, param_2, param_3), bind_signed(param_4, param_5, param_6, param_7), bind_signed(param_8, param_9, param_10, param_11));
}

vec3 bind_corrected(inout vec3 mean, uint row)
{
    uint end = BindStatic_1._data[(constants.corrective_ptr + row) + 1u];
    uint _868 = constants.corrective_ptr + row;
    for (uint e = BindStatic_1._data[_868]; e < end; e++)
    {
        uint param = constants.corrective_column;
        uint param_1 = e;
        uint param_2 = constants.corrective_column_width;
        uint column = bind_code(param, param_1, param_2);
        uint _step = constants.corrective_mean_step + (3u * column);
        uint param_3 = constants.corrective_mean;
        uint param_4 = 3u * e;
        uint param_5 = constants.corrective_mean_width;
        uint param_6 = _step;
        mean += (bind_signed3(param_3, param_4, param_5, param_6) * Pose_1._data[constants.features + column]);
    }
    return mean;
}

vec3 late_add(vec3 posed, float weight, vec3 delta)
{
    return posed + (delta * weight);
}

vec3 bind_late(uint row)
{
    vec3 sum = vec3(0.0);
    uint end = BindStatic_1._data[(constants.late_ptr + row) + 1u];
    uint _946 = constants.late_ptr + row;
    for (uint e = BindStatic_1._data[_946]; e < end; e++)
    {
        uint param = constants.late_column;
        uint param_1 = e;
        uint param_2 = constants.late_column_width;
        uint column = bind_code(param, param_1, param_2);
        uint param_3 = constants.late_mean;
        uint param_4 = 3u * e;
        uint param_5 = constants.late_mean_width;
        uint param_6 = constants.late_mean_step + (3u * column);
        vec3 delta = bind_signed3(param_3, param_4, param_5, param_6);
        vec3 param_7 = sum;
        float param_8 = Pose_1._data[constants.late + column];
        vec3 param_9 = delta;
        sum = late_add(param_7, param_8, param_9);
    }
    return sum;
}

vec3 transform_point(Rows4 m, vec3 p)
{
    return vec3((((m.row0.x * p.x) + (m.row0.y * p.y)) + (m.row0.z * p.z)) + m.row0.w, (((m.row1.x * p.x) + (m.row1.y * p.y)) + (m.row1.z * p.z)) + m.row1.w, (((m.row2.x * p.x) + (m.row2.y * p.y)) + (m.row2.z * p.z)) + m.row2.w);
}

vec4 quat_from_matrix(Rows3 m)
{
    float d0 = m.row0.x;
    float d1 = m.row1.y;
    float d2 = m.row2.z;
    vec4 size = sqrt(max(vec4(((1.0 + d0) + d1) + d2, ((1.0 + d0) - d1) - d2, ((1.0 - d0) + d1) - d2, ((1.0 - d0) - d1) + d2), vec4(0.0)));
    float a = m.row2.y - m.row1.z;
    float b = m.row0.z - m.row2.x;
    float c = m.row1.x - m.row0.y;
    float d = m.row1.x + m.row0.y;
    float e = m.row0.z + m.row2.x;
    float f = m.row2.y + m.row1.z;
    if (((size.x >= size.y) && (size.x >= size.z)) && (size.x >= size.w))
    {
        return vec4(size.x * size.x, a, b, c) / vec4(2.0 * size.x);
    }
    if ((size.y >= size.z) && (size.y >= size.w))
    {
        return vec4(a, size.y * size.y, d, e) / vec4(2.0 * size.y);
    }
    if (size.z >= size.w)
    {
        return vec4(b, d, size.z * size.z, f) / vec4(2.0 * size.z);
    }
    return vec4(c, e, f, size.w * size.w) / vec4(2.0 * size.w);
}

vec4 quat_multiply(vec4 a, vec4 b)
{
    return vec4((((a.x * b.x) - (a.y * b.y)) - (a.z * b.z)) - (a.w * b.w), (((a.x * b.y) + (a.y * b.x)) + (a.z * b.w)) - (a.w * b.z), (((a.x * b.z) - (a.y * b.w)) + (a.z * b.x)) + (a.w * b.y), (((a.x * b.w) + (a.y * b.z)) - (a.z * b.y)) + (a.w * b.x));
}

BoundSplat bind_by_matrix(Rows4 transform, Rows3 rotation, vec3 mean, vec3 late, vec4 quat_wxyz)
{
    Rows4 param = transform;
    vec3 param_1 = mean;
    BoundSplat b;
    b.mean = transform_point(param, param_1) + late;
    Rows3 param_2 = rotation;
    vec4 param_3 = quat_from_matrix(param_2);
    vec4 param_4 = quat_wxyz;
    b.quat_wxyz = quat_multiply(param_3, param_4);
    b.sh_rotation = rotation;
    return b;
}

Rows3 identity_rows()
{
    Rows3 r;
    r.row0 = vec3(1.0, 0.0, 0.0);
    r.row1 = vec3(0.0, 1.0, 0.0);
    r.row2 = vec3(0.0, 0.0, 1.0);
    return r;
}

vec3 rotate_inverse(Rows3 m, vec3 v)
{
    return ((m.row0 * v.x) + (m.row1 * v.y)) + (m.row2 * v.z);
}

Rows3 multiply(Rows3 a, Rows3 b)
{
    Rows3 param = b;
    vec3 param_1 = a.row0;
    Rows3 r;
    r.row0 = rotate_inverse(param, param_1);
    Rows3 param_2 = b;
    vec3 param_3 = a.row1;
    r.row1 = rotate_inverse(param_2, param_3);
    Rows3 param_4 = b;
    vec3 param_5 = a.row2;
    r.row2 = rotate_inverse(param_4, param_5);
    return r;
}

BoundSplat bind_place(inout BoundSplat b, Rows4 world, vec4 world_quat_wxyz)
{
    Rows4 param = world;
    vec3 param_1 = b.mean;
    b.mean = transform_point(param, param_1);
    vec4 param_2 = world_quat_wxyz;
    vec4 param_3 = b.quat_wxyz;
    b.quat_wxyz = quat_multiply(param_2, param_3);
    Rows4 param_4 = world;
    Rows3 param_5 = linear_part(param_4);
    Rows3 param_6 = b.sh_rotation;
    b.sh_rotation = multiply(param_5, param_6);
    return b;
}

void _bind_skin(uvec3 id)
{
    if (id.x >= constants.rows)
    {
        return;
    }
    uint row = constants.first + id.x;
    Rows4 transform;
    transform.row0 = constants.group_matrix_row0;
    transform.row1 = constants.group_matrix_row1;
    transform.row2 = constants.group_matrix_row2;
    Rows3 rotation;
    rotation.row0 = constants.group_rotation_row0.xyz;
    rotation.row1 = constants.group_rotation_row1.xyz;
    rotation.row2 = constants.group_rotation_row2.xyz;
    if (constants.binding_rule == 1u)
    {
        uint param = row;
        transform = bind_skin_matrix(param);
        if (constants.rotation_rule == 4u)
        {
            Rows4 param_1 = transform;
            Rows3 param_2 = linear_part(param_1);
            Rows3 _1202 = polar(param_2);
            rotation = _1202;
        }
    }
    Rows4 world;
    world.row0 = constants.world_row0;
    world.row1 = constants.world_row1;
    world.row2 = constants.world_row2;
    vec4 mean = Splats_1._data[row];
    vec3 param_3 = mean.xyz;
    uint param_4 = row;
    vec3 _1230 = bind_corrected(param_3, param_4);
    uint param_5 = row;
    Rows4 param_6 = transform;
    Rows3 param_7 = rotation;
    vec3 param_8 = _1230;
    vec3 param_9 = bind_late(param_5);
    vec4 param_10 = Splats_1._data[constants.count + row];
    BoundSplat b = bind_by_matrix(param_6, param_7, param_8, param_9, param_10);
    if (constants.sh_direction == 1u)
    {
        b.sh_rotation = identity_rows();
    }
)~"
R"~(    BoundSplat param_11 = b;
    Rows4 param_12 = world;
    vec4 param_13 = constants.world_quat_wxyz;
    BoundSplat _1264 = bind_place(param_11, param_12, param_13);
    b = _1264;
    Splats_1._data[row] = vec4(b.mean, mean.w);
    Splats_1._data[constants.count + row] = b.quat_wxyz;
    Splats_1._data[(2u * constants.count) + row] = vec4(b.sh_rotation.row0, Splats_1._data[(2u * constants.count) + row].w);
    Splats_1._data[(3u * constants.count) + row] = vec4(b.sh_rotation.row1, Splats_1._data[(3u * constants.count) + row].w);
    Splats_1._data[(4u * constants.count) + row] = vec4(b.sh_rotation.row2, Splats_1._data[(4u * constants.count) + row].w);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _bind_skin(param);
}

)~"},
{"bind_triangles", R"~(#version 430
// Generated from hlsl/bind_triangles.hlsl, entry bind_triangles, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

struct Rows3
{
    vec3 row0;
    vec3 row1;
    vec3 row2;
};

struct TriangleShape
{
    Rows3 frame;
    float size;
    vec3 across;
};

layout(binding = 0, std430) readonly buffer SurfaceStatic
{
    uint _data[];
} SurfaceStatic_1;

layout(binding = 8, std140) uniform BindTrianglesConstants
{
    uint triangles;
    uint vertices;
    uint corners;
    uint corners_width;
    uint canonical;
    uint canonical_width;
    uint canonical_scale;
    uint rotation_rule;
    uint quaternion_sign;
} constants;

layout(binding = 1, std430) readonly buffer Mesh
{
    vec4 _data[];
} Mesh_1;

layout(binding = 2, std430) buffer Triangles
{
    vec4 _data[];
} Triangles_1;

uint packed_element(uint word, uint bit, uint width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

uint surface_code(uint section, uint index, uint width)
{
    if (width == 32u)
    {
        return SurfaceStatic_1._data[section + index];
    }
    uint bit = index * width;
    uint param = SurfaceStatic_1._data[section + (bit >> uint(5))];
    uint param_1 = bit;
    uint param_2 = width;
    return packed_element(param, param_1, param_2);
}

uint corner(uint plane, uint row)
{
    uint param = constants.corners;
    uint param_1 = (plane * constants.triangles) + row;
    uint param_2 = constants.corners_width;
    return surface_code(param, param_1, param_2);
}

float surface_linear(uint section, uint index, uint width, uint scale)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = surface_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    return uintBitsToFloat(SurfaceStatic_1._data[scale]) + (uintBitsToFloat(SurfaceStatic_1._data[scale + 1u]) * float(code));
}

vec3 surface_linear3(uint section, uint index, uint stride, uint width, uint scale)
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
    return vec3(surface_linear(param, param_1, param_2, param_3), surface_linear(param_4, param_5, param_6, param_7), surface_linear(param_8, param_9, param_10, param_11));
}

vec3 canonical_position(uint vertex)
{
    uint param = constants.canonical;
    uint param_1 = vertex;
    uint param_2 = constants.vertices;
    uint param_3 = constants.canonical_width;
    uint param_4 = constants.canonical_scale;
    return surface_linear3(param, param_1, param_2, param_3, param_4);
}

vec3 bind_unit(vec3 v)
{
    return v / vec3(max(length(v), 1.0000000031710768509710513471353e-30));
}

Rows3 bind_columns(vec3 x, vec3 y, vec3 z)
{
    Rows3 m;
    m.row0 = vec3(x.x, y.x, z.x);
    m.row1 = vec3(x.y, y.y, z.y);
    m.row2 = vec3(x.z, y.z, z.z);
    return m;
}

TriangleShape triangle_by_edge(vec3 p0, vec3 p1, vec3 p2)
{
    vec3 e = p1 - p0;
    vec3 f = p2 - p0;
    TriangleShape t;
    t.across = cross(e, f);
    vec3 param = e;
    vec3 a0 = bind_unit(param);
    vec3 param_1 = cross(a0, f);
    vec3 a1 = bind_unit(param_1);
    vec3 param_2 = cross(a1, a0);
    vec3 a2 = -bind_unit(param_2);
    vec3 param_3 = a0;
    vec3 param_4 = a1;
    vec3 param_5 = a2;
    t.frame = bind_columns(param_3, param_4, param_5);
    t.size = (length(e) + abs(dot(a2, f))) / 2.0;
    return t;
}

vec4 quat_from_matrix(Rows3 m)
{
    float d0 = m.row0.x;
    float d1 = m.row1.y;
    float d2 = m.row2.z;
    vec4 size = sqrt(max(vec4(((1.0 + d0) + d1) + d2, ((1.0 + d0) - d1) - d2, ((1.0 - d0) + d1) - d2, ((1.0 - d0) - d1) + d2), vec4(0.0)));
    float a = m.row2.y - m.row1.z;
    float b = m.row0.z - m.row2.x;
    float c = m.row1.x - m.row0.y;
    float d = m.row1.x + m.row0.y;
    float e = m.row0.z + m.row2.x;
    float f = m.row2.y + m.row1.z;
    if (((size.x >= size.y) && (size.x >= size.z)) && (size.x >= size.w))
    {
        return vec4(size.x * size.x, a, b, c) / vec4(2.0 * size.x);
    }
    if ((size.y >= size.z) && (size.y >= size.w))
    {
        return vec4(a, size.y * size.y, d, e) / vec4(2.0 * size.y);
    }
    if (size.z >= size.w)
    {
        return vec4(b, d, size.z * size.z, f) / vec4(2.0 * size.z);
    }
    return vec4(c, e, f, size.w * size.w) / vec4(2.0 * size.w);
}

TriangleShape triangle_by_area(vec3 p0, vec3 p1, vec3 p2)
{
    vec3 e = p1 - p0;
    TriangleShape t;
    t.across = cross(e, p2 - p0);
    vec3 param = t.across;
    vec3 param_1 = cross(e, bind_unit(param));
    vec3 x = bind_unit(param_1);
    vec3 param_2 = cross(e, x);
    vec3 param_3 = e;
    vec3 param_4 = x;
    vec3 param_5 = bind_unit(param_2);
    vec3 param_6 = bind_unit(param_3);
    t.frame = bind_columns(param_4, param_5, param_6);
    t.size = length(t.across) / 2.0;
    return t;
}

vec3 rotate(Rows3 m, vec3 v)
{
    return vec3(dot(m.row0, v), dot(m.row1, v), dot(m.row2, v));
}

Rows3 multiply_transposed(Rows3 a, Rows3 b)
{
    Rows3 param = b;
    vec3 param_1 = a.row0;
    Rows3 r;
    r.row0 = rotate(param, param_1);
    Rows3 param_2 = b;
    vec3 param_3 = a.row1;
    r.row1 = rotate(param_2, param_3);
    Rows3 param_4 = b;
    vec3 param_5 = a.row2;
    r.row2 = rotate(param_4, param_5);
    return r;
}

vec4 triangle_turn(Rows3 frame, Rows3 canonical_frame, uint quaternion_sign)
{
    Rows3 param = frame;
    Rows3 param_1 = canonical_frame;
    Rows3 param_2 = multiply_transposed(param, param_1);
    vec4 turn = quat_from_matrix(param_2);
    bool negative = (quaternion_sign == 1u) && (turn.x < 0.0);
    if (quaternion_sign == 2u)
    {
        negative = max(turn.z, turn.w) > max(turn.x, turn.y);
    }
    vec4 _499 = -turn;
    bvec4 _502 = bvec4(negative);
    return vec4(_502.x ? _499.x : turn.x, _502.y ? _499.y : turn.y, _502.z ? _499.z : turn.z, _502.w ? _499.w : turn.w);
}

void _bind_triangles(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.triangles)
    {
        return;
    }
    uint param = 0u;
    uint param_1 = row;
    uint v0 = corner(param, param_1);
    uint param_2 = 1u;
    uint param_3 = row;
    uint v1 = corner(param_2, param_3);
    uint param_4 = 2u;
    uint param_5 = row;
    uint v2 = corner(param_4, param_5);
    vec3 p0 = Mesh_1._data[v0].xyz;
    vec3 p1 = Mesh_1._data[v1].xyz;
    vec3 p2 = Mesh_1._data[v2].xyz;
    uint param_6 = v0;
    vec3 c0 = canonical_position(param_6);
    uint param_7 = v1;
    vec3 c1 = canonical_position(param_7);
    uint param_8 = v2;
    vec3 c2 = canonical_position(param_8);
    TriangleShape shape;
    TriangleShape rest;
    vec4 turn;
    if (constants.rotation_rule == 2u)
    {
        vec3 param_9 = p0;
        vec3 param_10 = p1;
        vec3 param_11 = p2;
        shape = triangle_by_edge(param_9, param_10, param_11);
        vec3 param_12 = c0;
        vec3 param_13 = c1;
        vec3 param_14 = c2;
        rest = triangle_by_edge(param_12, param_13, param_14);
        Rows3 param_15 = shape.frame;
        turn = quat_from_matrix(param_15);
    }
    else
    {
        vec3 param_16 = p0;
        vec3 param_17 = p1;
        vec3 param_18 = p2;
        shape = triangle_by_area(param_16, param_17, param_18);
        vec3 param_19 = c0;
        vec3 param_20 = c1;
        vec3 param_21 = c2;
        rest = triangle_by_area(param_19, param_20, param_21);
        Rows3 param_22 = shape.frame;
        Rows3 param_23 = rest.frame;
        uint param_24 = constants.quaternion_sign;
        turn = triangle_turn(param_22, param_23, param_24);
    }
    Triangles_1._data[row] = vec4(shape.across, shape.size);
    Triangles_1._data[constants.triangles + row] = turn;
    Triangles_1._data[(2u * constants.triangles) + row] = vec4(rest.size, float(v0), float(v1), float(v2));
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _bind_triangles(param);
}

)~"},
{"bind_vertices", R"~(#version 430
// Generated from hlsl/bind_vertices.hlsl, entry bind_vertices, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

struct Rows4
{
    vec4 row0;
    vec4 row1;
    vec4 row2;
};

layout(binding = 0, std430) readonly buffer SurfaceStatic
{
    uint _data[];
} SurfaceStatic_1;

layout(binding = 8, std140) uniform BindVerticesConstants
{
    uint vertices;
    uint triangles;
    uint vertex_triangle_ptr;
    uint vertex_triangle;
    uint vertex_triangle_width;
    float normal_floor;
    float quaternion_floor;
    uint rotation_rule;
    uint skin_ptr;
    uint skin_column;
    uint skin_column_width;
    uint skin_weight;
    uint skin_weight_width;
    uint skin_weight_step;
    uint joints;
} constants;

layout(binding = 2, std430) readonly buffer Pose
{
    float _data[];
} Pose_1;

layout(binding = 1, std430) readonly buffer Triangles
{
    vec4 _data[];
} Triangles_1;

layout(binding = 3, std430) buffer Mesh
{
    vec4 _data[];
} Mesh_1;

uint packed_element(uint word, uint bit, uint width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

uint surface_code(uint section, uint index, uint width)
{
    if (width == 32u)
    {
        return SurfaceStatic_1._data[section + index];
    }
    uint bit = index * width;
    uint param = SurfaceStatic_1._data[section + (bit >> uint(5))];
    uint param_1 = bit;
    uint param_2 = width;
    return packed_element(param, param_1, param_2);
}

vec3 vertex_normal(vec3 sum_across, float normal_floor)
{
    return sum_across / vec3(max(length(sum_across), normal_floor));
}

Rows4 skin_none()
{
    Rows4 sum;
    sum.row0 = vec4(0.0);
    sum.row1 = vec4(0.0);
    sum.row2 = vec4(0.0);
    return sum;
}

float surface_weight(uint section, uint index, uint width, uint _step)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = surface_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    return uintBitsToFloat(SurfaceStatic_1._data[_step]) * float(code);
}

Rows4 vertex_joint(uint joint)
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

Rows4 vertex_skin_matrix(uint row)
{
    Rows4 blended = skin_none();
    uint end = SurfaceStatic_1._data[(constants.skin_ptr + row) + 1u];
    uint _308 = constants.skin_ptr + row;
    for (uint e = SurfaceStatic_1._data[_308]; e < end; e++)
    {
        uint param = constants.skin_weight;
        uint param_1 = e;
        uint param_2 = constants.skin_weight_width;
        uint param_3 = constants.skin_weight_step;
        float weight = surface_weight(param, param_1, param_2, param_3);
        uint param_4 = constants.skin_column;
        uint param_5 = e;
        uint param_6 = constants.skin_column_width;
        uint param_7 = surface_code(param_4, param_5, param_6);
        Rows4 param_8 = blended;
        float param_9 = weight;
        Rows4 param_10 = vertex_joint(param_7);
        Rows4 _353 = skin_add(param_8, param_9, param_10);
        blended = _353;
    }
    return blended;
}

vec4 vertex_quat_mean(vec4 sum_turn, float sum_area)
{
    return sum_turn / vec4(max(sum_area, 1.0000000031710768509710513471353e-30));
}

vec4 vertex_quat(vec4 sum_turn, float quaternion_floor)
{
    return sum_turn / vec4(max(sqrt(dot(sum_turn, sum_turn)), quaternion_floor));
}

void _bind_vertices(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.vertices)
    {
        return;
    }
    vec3 across = vec3(0.0);
    vec4 turn = vec4(0.0);
    float area = 0.0;
    uint end = SurfaceStatic_1._data[(constants.vertex_triangle_ptr + row) + 1u];
    uint _386 = constants.vertex_triangle_ptr + row;
    for (uint e = SurfaceStatic_1._data[_386]; e < end; e++)
    {
        uint param = constants.vertex_triangle;
        uint param_1 = e;
        uint param_2 = constants.vertex_triangle_width;
        uint t = surface_code(param, param_1, param_2);
        float canonical_size = Triangles_1._data[(2u * constants.triangles) + t].x;
        across += Triangles_1._data[t].xyz;
        turn += (Triangles_1._data[constants.triangles + t] * canonical_size);
        area += canonical_size;
    }
    vec3 param_3 = across;
    float param_4 = constants.normal_floor;
    Mesh_1._data[constants.vertices + row] = vec4(vertex_normal(param_3, param_4), 0.0);
    if (constants.rotation_rule == 3u)
    {
        uint param_5 = row;
        Rows4 blended = vertex_skin_matrix(param_5);
        Mesh_1._data[(2u * constants.vertices) + row] = blended.row0;
        Mesh_1._data[(3u * constants.vertices) + row] = blended.row1;
        Mesh_1._data[(4u * constants.vertices) + row] = blended.row2;
    }
    else
    {
        if (constants.rotation_rule == 1u)
        {
            vec4 param_6 = turn;
            float param_7 = area;
            Mesh_1._data[(2u * constants.vertices) + row] = vertex_quat_mean(param_6, param_7);
        }
        else
        {
            vec4 param_8 = turn;
            float param_9 = constants.quaternion_floor;
            Mesh_1._data[(2u * constants.vertices) + row] = vertex_quat(param_8, param_9);
        }
    }
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _bind_vertices(param);
}

)~"},
{"bind_surface", R"~(#version 430
// Generated from hlsl/bind_surface.hlsl, entry bind_surface, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

struct Rows3
{
    vec3 row0;
    vec3 row1;
    vec3 row2;
};

struct Rows4
{
    vec4 row0;
    vec4 row1;
    vec4 row2;
};

struct BoundSplat
{
    vec3 mean;
    vec4 quat_wxyz;
    Rows3 sh_rotation;
};

struct TriangleShape
{
    Rows3 frame;
    float size;
    vec3 across;
};

struct Foot
{
    uvec3 vertex;
    vec3 weight;
};

layout(binding = 0, std430) readonly buffer EmbedStatic
{
    uint _data[];
} EmbedStatic_1;

layout(binding = 8, std140) uniform BindSurfaceConstants
{
    uint count;
    uint vertices;
    uint triangles;
    uint triangle_ids;
    uint triangle_ids_width;
    uint barycentric;
    uint barycentric_width;
    uint barycentric_scale;
    uint displacement;
    uint displacement_width;
    uint displacement_scale;
    uint local_offset;
    uint local_offset_width;
    uint local_offset_scale;
    uint local_quat;
    uint local_quat_width;
    uint local_quat_scale;
    uint position_rule;
    uint rotation_rule;
    uint scale_rule;
    uint sh_direction;
    uint unused;
    float area_damping;
    float log_training_per_bundle;
    vec4 world_row0;
    vec4 world_row1;
    vec4 world_row2;
    vec4 world_quat_wxyz;
} constants;

layout(binding = 1, std430) readonly buffer Mesh
{
    vec4 _data[];
} Mesh_1;

layout(binding = 2, std430) readonly buffer Triangles
{
    vec4 _data[];
} Triangles_1;

layout(binding = 3, std430) buffer Splats
{
    vec4 _data[];
} Splats_1;

uint packed_element(uint word, uint bit, uint width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

uint embed_code(uint section, uint index, uint width)
{
    if (width == 32u)
    {
        return EmbedStatic_1._data[section + index];
    }
    uint bit = index * width;
    uint param = EmbedStatic_1._data[section + (bit >> uint(5))];
    uint param_1 = bit;
    uint param_2 = width;
    return packed_element(param, param_1, param_2);
}

float embed_linear(uint section, uint index, uint width, uint scale)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = embed_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    return uintBitsToFloat(EmbedStatic_1._data[scale]) + (uintBitsToFloat(EmbedStatic_1._data[scale + 1u]) * float(code));
}

vec3 embed_linear3(uint section, uint index, uint stride, uint width, uint scale)
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
    return vec3(embed_linear(param, param_1, param_2, param_3), embed_linear(param_4, param_5, param_6, param_7), embed_linear(param_8, param_9, param_10, param_11));
}

vec4 mesh_blend(uint plane, Foot foot)
{
    uint first = plane * constants.vertices;
    return ((Mesh_1._data[first + foot.vertex.x] * foot.weight.x) + (Mesh_1._data[first + foot.vertex.y] * foot.weight.y)) + (Mesh_1._data[first + foot.vertex.z] * foot.weight.z);
}

Rows3 polar(inout Rows3 m)
{
    for (int _step = 0; _step < 3; _step++)
    {
        vec3 c0 = cross(m.row1, m.row2);
        vec3 c1 = cross(m.row2, m.row0);
        vec3 c2 = cross(m.row0, m.row1);
        float determinant = dot(m.row0, c0);
        m.row0 = (m.row0 + (c0 / vec3(determinant))) * 0.5;
        m.row1 = (m.row1 + (c1 / vec3(determinant))) * 0.5;
        m.row2 = (m.row2 + (c2 / vec3(determinant))) * 0.5;
    }
    return m;
}

vec4 quat_from_matrix(Rows3 m)
{
    float d0 = m.row0.x;
    float d1 = m.row1.y;
    float d2 = m.row2.z;
    vec4 size = sqrt(max(vec4(((1.0 + d0) + d1) + d2, ((1.0 + d0) - d1) - d2, ((1.0 - d0) + d1) - d2, ((1.0 - d0) - d1) + d2), vec4(0.0)));
    float a = m.row2.y - m.row1.z;
    float b = m.row0.z - m.row2.x;
    float c = m.row1.x - m.row0.y;
    float d = m.row1.x + m.row0.y;
    float e = m.row0.z + m.row2.x;
    float f = m.row2.y + m.row1.z;
    if (((size.x >= size.y) && (size.x >= size.z)) && (size.x >= size.w))
    {
        return vec4(size.x * size.x, a, b, c) / vec4(2.0 * size.x);
    }
    if ((size.y >= size.z) && (size.y >= size.w))
    {
        return vec4(a, size.y * size.y, d, e) / vec4(2.0 * size.y);
    }
    if (size.z >= size.w)
    {
        return vec4(b, d, size.z * size.z, f) / vec4(2.0 * size.z);
    }
    return vec4(c, e, f, size.w * size.w) / vec4(2.0 * size.w);
}

vec4 surface_turn(uint triangle_id, Foot foot)
{
    if (constants.rotation_rule == 2u)
    {
        return Triangles_1._data[constants.triangles + triangle_id];
    }
    if (constants.rotation_rule == 3u)
    {
        uint param = 2u;
        Foot param_1 = foot;
        Rows3 blended;
        blended.row0 = mesh_blend(param, param_1).xyz;
        uint param_2 = 3u;
        Foot param_3 = foot;
        blended.row1 = mesh_blend(param_2, param_3).xyz;
        uint param_4 = 4u;
        Foot param_5 = foot;
        blended.row2 = mesh_blend(param_4, param_5).xyz;
        Rows3 param_6 = blended;
        Rows3 _1127 = polar(param_6);
        Rows3 param_7 = _1127;
        return quat_from_matrix(param_7);
    }
    uint param_8 = 2u;
    Foot param_9 = foot;
    return mesh_blend(param_8, param_9);
}

vec3 bind_unit(vec3 v)
{
    return v / vec3(max(length(v), 1.0000000031710768509710513471353e-30));
}

Rows3 bind_columns(vec3 x, vec3 y, vec3 z)
{
    Rows3 m;
    m.row0 = vec3(x.x, y.x, z.x);
    m.row1 = vec3(x.y, y.y, z.y);
    m.row2 = vec3(x.z, y.z, z.z);
    return m;
}

TriangleShape triangle_by_edge(vec3 p0, vec3 p1, vec3 p2)
{
    vec3 e = p1 - p0;
    vec3 f = p2 - p0;
    TriangleShape t;
    t.across = cross(e, f);
    vec3 param = e;
    vec3 a0 = bind_unit(param);
    vec3 param_1 = cross(a0, f);
    vec3 a1 = bind_unit(param_1);
    vec3 param_2 = cross(a1, a0);
    vec3 a2 = -bind_unit(param_2);
    vec3 param_3 = a0;
    vec3 param_4 = a1;
    vec3 param_5 = a2;
    t.frame = bind_columns(param_3, param_4, param_5);
    t.size = (length(e) + abs(dot(a2, f))) / 2.0;
    return t;
}

vec3 rotate(Rows3 m, vec3 v)
{
    return vec3(dot(m.row0, v), dot(m.row1, v), dot(m.row2, v));
}

vec3 surface_position(uint row, Foot foot, float size)
{
    uint param = 0u;
    Foot param_1 = foot;
    vec3 position = mesh_blend(param, param_1).xyz;
    if (constants.position_rule == 1u)
    {
        vec3 param_2 = Mesh_1._data[foot.vertex.x].xyz;
        vec3 param_3 = Mesh_1._data[foot.vertex.y].xyz;
        vec3 param_4 = Mesh_1._data[foot.vertex.z].xyz;
        TriangleShape shape = triangle_by_edge(param_2, param_3, param_4);
        uint param_5 = constants.local_offset;
        uint param_6 = row;
        uint param_7 = constants.count;
        uint param_8 = constants.local_offset_width;
        uint param_9 = constants.local_offset_scale;
        vec3 offset = embed_linear3(param_5, param_6, param_7, param_8, param_9);
        Rows3 param_10 = shape.frame;
        vec3 param_11 = offset;
        return position + (rotate(param_10, param_11) * size);
    }
    uint param_12 = 1u;
    Foot param_13 = foot;
    vec3 normal = mesh_blend(param_12, param_13).xyz;
    if (constants.position_rule == 0u)
    {
        vec3 param_14 = normal;
        normal = bind_unit(param_14);
    }
    uint param_15 = constants.displacement;
    uint param_16 = row;
    uint param_17 = constants.displacement_width;
    uint param_18 = constants.displacement_scale;
    return position + (normal * embed_linear(param_15, param_16, param_17, param_18));
}

vec4 bind_unit4(vec4 v)
{
    return v / vec4(max(sqrt(dot(v, v)), 1.0000000031710768509710513471353e-30));
}

vec4 quat_multiply(vec4 a, vec4 b)
{
    return vec4((((a.x * b.x) - (a.y * b.y)) - (a.z * b.z)) - (a.w * b.w), (((a.x * b.y) + (a.y * b.x)) + (a.z * b.w)) - (a.w * b.z), (((a.x * b.z) - (a.y * b.w)) + (a.z * b.x)) + (a.w * b.y), (((a.x * b.w) + (a.y * b.z)) - (a.z * b.y)) + (a.w * b.x));
}

Rows3 matrix_from_quat(vec4 q)
{
    float w = q.x;
    float x = q.y;
    float y = q.z;
    float z = q.w;
    Rows3 r;
    r.row0 = vec3(1.0 - (2.0 * ((y * y) + (z * z))), 2.0 * ((x * y) - (w * z)), 2.0 * ((x * z) + (w * y)));
    r.row1 = vec3(2.0 * ((x * y) + (w * z)), 1.0 - (2.0 * ((x * x) + (z * z))), 2.0 * ((y * z) - (w * x)));
    r.row2 = vec3(2.0 * ((x * z) - (w * y)), 2.0 * ((y * z) + (w * x)), 1.0 - (2.0 * ((x * x) + (y * y))));
    return r;
}

BoundSplat bind_by_turn(vec3 mean, vec4 turn, vec4 local_quat_wxyz)
{
    vec4 param = turn;
    vec4 unit_turn = bind_unit4(param);
    BoundSplat b;
    b.mean = mean;
    vec4 param_1 = unit_turn;
    vec4 param_2 = local_quat_wxyz;
    b.quat_wxyz = quat_multiply(param_1, param_2);
    vec4 param_3 = unit_turn;
    b.sh_rotation = matrix_from_quat(param_3);
    return b;
}

Rows3 identity_rows()
{
    Rows3 r;
    r.row0 = vec3(1.0, 0.0, 0.0);
    r.row1 = vec3(0.0, 1.0, 0.0);
    r.row2 = vec3(0.0, 0.0, 1.0);
    return r;
}

vec3 transform_point(Rows4 m, vec3 p)
{
    return vec3((((m.row0.x * p.x) + (m.row0.y * p.y)) + (m.row0.z * p.z)) + m.row0.w, (((m.row1.x * p.x) + (m.row1.y * p.y)) + (m.row1.z * p.z)) + m.row1.w, (((m.row2.x * p.x) + (m.row2.y * p.y)) + (m.row2.z * p.z)) + m.row2.w);
}

Rows3 linear_part(Rows4 m)
{
    Rows3 r;
    r.row0 = m.row0.xyz;
    r.row1 = m.row1.xyz;
    r.row2 = m.row2.xyz;
    return r;
}

vec3 rotate_inverse(Rows3 m, vec3 v)
{
    return ((m.row0 * v.x) + (m.row1 * v.y)) + (m.row2 * v.z);
}

Rows3 multiply(Rows3 a, Rows3 b)
{
    Rows3 param = b;
    vec3 param_1 = a.row0;
    Rows3 r;
    r.row0 = rotate_inverse(param, param_1);
    Rows3 param_2 = b;
    vec3 param_3 = a.row1;
    r.row1 = rotate_inverse(param_2, param_3);
    Rows3 param_4 = b;
    vec3 param_5 = a.row2;
    r.row2 = rotate_inverse(param_4, param_5);
    return r;
}

BoundSplat bind_place(inout BoundSplat b, Rows4 world, vec4 world_quat_wxyz)
{
    Rows4 param = world;
    vec3 param_1 = b.mean;
    b.mean = transform_point(param, param_1);
    vec4 param_2 = world_quat_wxyz;
    vec4 param_3 = b.quat_wxyz;
    b.quat_wxyz = quat_multiply(param_2, param_3);
    Rows4 param_4 = world;
    Rows3 param_5 = linear_part(param_4);
    Rows3 param_6 = b.sh_rotation;
    b.sh_rotation = multiply(param_5, param_6);
    return b;
}

vec3 scale_log_area(vec3 log_scale, float area, float canonical_area, float damping, float log_training_per_bundle)
{
    float ratio = (area + damping) / (canonical_area + damping);
    return ((log_scale + vec3(log_training_per_bundle)) * ratio) - vec3(log_training_per_bundle);
}

vec3 scale_linear(vec3 log_scale, float size, float canonical_size)
{
    return log_scale + vec3(log(max(size, 1.0000000031710768509710513471353e-30) / canonical_size));
}

vec3 surface_scale(vec3 log_scale, float size, float canonical)
{
    if (constants.scale_rule == 1u)
    {
        vec3 param = log_scale;
        float param_1 = size;
        float param_2 = canonical;
        float param_3 = constants.area_damping;
        float param_4 = constants.log_training_per_bundle;
        return scale_log_area(param, param_1, param_2, param_3, param_4);
    }
    if (constants.scale_rule == 2u)
    {
        vec3 param_5 = log_scale;
        float param_6 = size;
        float param_7 = canonical;
        return scale_linear(param_5, param_6, param_7);
    }
    return log_scale;
}

void _bind_surface(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    uint param = constants.triangle_ids;
    uint param_1 = row;
    uint param_2 = constants.triangle_ids_width;
    uint t = embed_code(param, param_1, param_2);
    vec4 rest = Triangles_1._data[(2u)~"
R"~( * constants.triangles) + t];
    Foot foot;
    foot.vertex = uvec3(rest.yzw);
    uint param_3 = constants.barycentric;
    uint param_4 = row;
    uint param_5 = constants.count;
    uint param_6 = constants.barycentric_width;
    uint param_7 = constants.barycentric_scale;
    foot.weight = embed_linear3(param_3, param_4, param_5, param_6, param_7);
    uint param_8 = t;
    Foot param_9 = foot;
    vec4 turn = surface_turn(param_8, param_9);
    float size = Triangles_1._data[t].w;
    uint param_10 = constants.local_quat;
    uint param_11 = row;
    uint param_12 = constants.local_quat_width;
    uint param_13 = constants.local_quat_scale;
    uint param_14 = constants.local_quat;
    uint param_15 = constants.count + row;
    uint param_16 = constants.count;
    uint param_17 = constants.local_quat_width;
    uint param_18 = constants.local_quat_scale + 2u;
    vec4 local_quat_wxyz = vec4(embed_linear(param_10, param_11, param_12, param_13), embed_linear3(param_14, param_15, param_16, param_17, param_18));
    uint param_19 = row;
    Foot param_20 = foot;
    float param_21 = size;
    vec3 param_22 = surface_position(param_19, param_20, param_21);
    vec4 param_23 = turn;
    vec4 param_24 = local_quat_wxyz;
    BoundSplat b = bind_by_turn(param_22, param_23, param_24);
    if (constants.sh_direction == 1u)
    {
        b.sh_rotation = identity_rows();
    }
    Rows4 world;
    world.row0 = constants.world_row0;
    world.row1 = constants.world_row1;
    world.row2 = constants.world_row2;
    BoundSplat param_25 = b;
    Rows4 param_26 = world;
    vec4 param_27 = constants.world_quat_wxyz;
    BoundSplat _1417 = bind_place(param_25, param_26, param_27);
    b = _1417;
    vec3 log_scale = vec3(Splats_1._data[(2u * constants.count) + row].w, Splats_1._data[(3u * constants.count) + row].w, Splats_1._data[(4u * constants.count) + row].w);
    vec3 param_28 = log_scale;
    float param_29 = size;
    float param_30 = rest.x;
    log_scale = surface_scale(param_28, param_29, param_30);
    Splats_1._data[row] = vec4(b.mean, Splats_1._data[row].w);
    Splats_1._data[constants.count + row] = b.quat_wxyz;
    Splats_1._data[(2u * constants.count) + row] = vec4(b.sh_rotation.row0, log_scale.x);
    Splats_1._data[(3u * constants.count) + row] = vec4(b.sh_rotation.row1, log_scale.y);
    Splats_1._data[(4u * constants.count) + row] = vec4(b.sh_rotation.row2, log_scale.z);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _bind_surface(param);
}

)~"},
{"activate", R"~(#version 430
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

)~"},
{"project", R"~(#version 430
// Generated from hlsl/project.hlsl, entry project, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

struct Rows3
{
    vec3 row0;
    vec3 row1;
    vec3 row2;
};

struct Rows4
{
    vec4 row0;
    vec4 row1;
    vec4 row2;
};

struct Covariance
{
    float xx;
    float xy;
    float xz;
    float yy;
    float yz;
    float zz;
};

struct SplatCamera
{
    Rows4 camera_from_world;
    vec4 clip_x;
    vec4 clip_y;
    vec4 clip_z;
    vec4 clip_w;
    vec2 tan_half_fov;
    vec2 size;
    float low_pass;
    float near_z;
};

struct SeenSplat
{
    vec2 centre;
    float depth;
    vec3 conic;
    float radius;
    float clip_depth;
};

layout(binding = 8, std140) uniform ProjectConstants
{
    uint count;
    uint sh_degree;
    float near_z;
    float low_pass;
    vec4 camera_row0;
    vec4 camera_row1;
    vec4 camera_row2;
    vec4 clip_row0;
    vec4 clip_row1;
    vec4 clip_row2;
    vec4 clip_row3;
    vec4 eye;
    vec2 tan_half_fov;
    vec2 image_size;
} constants;

layout(binding = 1, std430) readonly buffer Sh
{
    float _data[];
} Sh_1;

layout(binding = 0, std430) readonly buffer Splats
{
    vec4 _data[];
} Splats_1;

layout(binding = 2, std430) buffer Projected
{
    vec4 _data[];
} Projected_1;

SplatCamera project_camera()
{
    SplatCamera camera;
    camera.camera_from_world.row0 = constants.camera_row0;
    camera.camera_from_world.row1 = constants.camera_row1;
    camera.camera_from_world.row2 = constants.camera_row2;
    camera.clip_x = constants.clip_row0;
    camera.clip_y = constants.clip_row1;
    camera.clip_z = constants.clip_row2;
    camera.clip_w = constants.clip_row3;
    camera.tan_half_fov = constants.tan_half_fov;
    camera.size = constants.image_size;
    camera.low_pass = constants.low_pass;
    camera.near_z = constants.near_z;
    return camera;
}

vec3 transform_point(Rows4 m, vec3 p)
{
    return vec3((((m.row0.x * p.x) + (m.row0.y * p.y)) + (m.row0.z * p.z)) + m.row0.w, (((m.row1.x * p.x) + (m.row1.y * p.y)) + (m.row1.z * p.z)) + m.row1.w, (((m.row2.x * p.x) + (m.row2.y * p.y)) + (m.row2.z * p.z)) + m.row2.w);
}

Rows3 matrix_from_quat(vec4 q)
{
    float w = q.x;
    float x = q.y;
    float y = q.z;
    float z = q.w;
    Rows3 r;
    r.row0 = vec3(1.0 - (2.0 * ((y * y) + (z * z))), 2.0 * ((x * y) - (w * z)), 2.0 * ((x * z) + (w * y)));
    r.row1 = vec3(2.0 * ((x * y) + (w * z)), 1.0 - (2.0 * ((x * x) + (z * z))), 2.0 * ((y * z) - (w * x)));
    r.row2 = vec3(2.0 * ((x * z) - (w * y)), 2.0 * ((y * z) + (w * x)), 1.0 - (2.0 * ((x * x) + (y * y))));
    return r;
}

Covariance covariance(vec3 scale, vec4 quat_wxyz)
{
    vec4 param = quat_wxyz;
    Rows3 r = matrix_from_quat(param);
    vec3 m0 = r.row0 * scale;
    vec3 m1 = r.row1 * scale;
    vec3 m2 = r.row2 * scale;
    Covariance s;
    s.xx = dot(m0, m0);
    s.xy = dot(m0, m1);
    s.xz = dot(m0, m2);
    s.yy = dot(m1, m1);
    s.yz = dot(m1, m2);
    s.zz = dot(m2, m2);
    return s;
}

float project_form(vec3 a, Covariance s, vec3 b)
{
    float x = ((a.x * s.xx) + (a.y * s.xy)) + (a.z * s.xz);
    float y = ((a.x * s.xy) + (a.y * s.yy)) + (a.z * s.yz);
    float z = ((a.x * s.xz) + (a.y * s.yz)) + (a.z * s.zz);
    return ((x * b.x) + (y * b.y)) + (z * b.z);
}

vec3 projected_covariance(vec3 p, Covariance s, SplatCamera camera)
{
    vec2 focal = camera.size / (camera.tan_half_fov * 2.0);
    vec2 limit = camera.tan_half_fov * 1.2999999523162841796875;
    vec2 xy = min(limit, max(-limit, p.xy / vec2(p.z))) * p.z;
    vec3 w0 = camera.camera_from_world.row0.xyz;
    vec3 w1 = camera.camera_from_world.row1.xyz;
    vec3 w2 = camera.camera_from_world.row2.xyz;
    vec3 t0 = (w0 * (focal.x / p.z)) + (w2 * ((-(focal.x * xy.x)) / (p.z * p.z)));
    vec3 t1 = (w1 * (focal.y / p.z)) + (w2 * ((-(focal.y * xy.y)) / (p.z * p.z)));
    vec3 param = t0;
    Covariance param_1 = s;
    vec3 param_2 = t0;
    vec3 param_3 = t1;
    Covariance param_4 = s;
    vec3 param_5 = t0;
    vec3 param_6 = t1;
    Covariance param_7 = s;
    vec3 param_8 = t1;
    return vec3(project_form(param, param_1, param_2) + camera.low_pass, project_form(param_3, param_4, param_5), project_form(param_6, param_7, param_8) + camera.low_pass);
}

bool is_finite(float x)
{
    return (floatBitsToUint(x) & 2139095040u) != 2139095040u;
}

bool touches_image(vec2 centre, float extent, vec2 size)
{
    vec2 grid = ceil(size / vec2(16.0));
    vec2 low = clamp((centre - vec2(extent)) / vec2(16.0), vec2(-1000000.0), vec2(1000000.0));
    vec2 high = clamp((((centre + vec2(extent)) + vec2(16.0)) - vec2(1.0)) / vec2(16.0), vec2(-1000000.0), vec2(1000000.0));
    low = clamp(trunc(low), vec2(0.0), grid);
    high = clamp(trunc(high), vec2(0.0), grid);
    return (high.x > low.x) && (high.y > low.y);
}

SeenSplat project_splat(vec3 mean, vec3 scale, vec4 quat_wxyz, SplatCamera camera)
{
    Rows4 param = camera.camera_from_world;
    vec3 param_1 = mean;
    vec3 p = transform_point(param, param_1);
    vec3 param_2 = scale;
    vec4 param_3 = quat_wxyz;
    vec3 param_4 = p;
    Covariance param_5 = covariance(param_2, param_3);
    SplatCamera param_6 = camera;
    vec3 cov = projected_covariance(param_4, param_5, param_6);
    float det = (cov.x * cov.z) - (cov.y * cov.y);
    float mid = 0.5 * (cov.x + cov.z);
    float root = sqrt(max(0.100000001490116119384765625, (mid * mid) - det));
    float radius = ceil(3.0 * sqrt(max(mid + root, mid - root)));
    vec4 at = vec4(mean, 1.0);
    float reciprocal = 1.0 / (dot(camera.clip_w, at) + 1.0000000116860974230803549289703e-07);
    vec2 ndc = vec2(dot(camera.clip_x, at), dot(camera.clip_y, at)) * reciprocal;
    SeenSplat seen;
    seen.centre = (ndc * (camera.size * 0.5)) + ((camera.size * 0.5) - vec2(0.5));
    seen.depth = p.z;
    seen.conic = vec3(cov.z, -cov.y, cov.x) * (1.0 / det);
    float param_7 = det;
    float param_8 = radius;
    float param_9 = seen.centre.x + seen.centre.y;
    bool sound = ((is_finite(param_7) && (abs(det) > 0.0)) && is_finite(param_8)) && is_finite(param_9);
    vec2 param_10 = seen.centre;
    float param_11 = radius;
    vec2 param_12 = camera.size;
    bool drawn = (sound && (p.z > camera.near_z)) && touches_image(param_10, param_11, param_12);
    seen.radius = drawn ? radius : 0.0;
    seen.clip_depth = clamp(dot(camera.clip_z, at) * reciprocal, 0.0, 1.0);
    return seen;
}

vec3 rotate_inverse(Rows3 m, vec3 v)
{
    return ((m.row0 * v.x) + (m.row1 * v.y)) + (m.row2 * v.z);
}

vec3 sh_coefficient(uint k, uint row)
{
    uint at = ((3u * k) * constants.count) + row;
    return vec3(Sh_1._data[at], Sh_1._data[at + constants.count], Sh_1._data[at + (2u * constants.count)]);
}

vec3 sh_band0(vec3 k0)
{
    return k0 * 0.2820948064327239990234375;
}

vec3 sh_band1(vec3 d, vec3 k1, vec3 k2, vec3 k3)
{
    return ((k1 * ((-0.48860251903533935546875) * d.y)) + (k2 * (0.48860251903533935546875 * d.z))) + (k3 * ((-0.48860251903533935546875) * d.x));
}

vec3 sh_band2(vec3 d, vec3 k4, vec3 k5, vec3 k6, vec3 k7, vec3 k8)
{
    float xx = d.x * d.x;
    float yy = d.y * d.y;
    float zz = d.z * d.z;
    return ((((k4 * (1.09254848957061767578125 * (d.x * d.y))) + (k5 * ((-1.09254848957061767578125) * (d.y * d.z)))) + (k6 * (0.3153915703296661376953125 * (((2.0 * zz) - xx) - yy)))) + (k7 * ((-1.09254848957061767578125) * (d.x * d.z)))) + (k8 * (0.546274244785308837890625 * (xx - yy)));
}

vec3 sh_band3(vec3 d, vec3 k9, vec3 k10, vec3 k11, vec3 k12, vec3 k13, vec3 k14, vec3 k15)
{
    float xx = d.x * d.x;
    float yy = d.y * d.y;
    float zz = d.z * d.z;
    vec3 _564 = ((((((k9 * (((-0.590043604373931884765625) * d.y) * ((3.0 * xx) - yy))) + (k10 * ((2.8906114101409912109375 * (d.x * d.y)) * d.z))) + (k11 * (((-0.4570457935333251953125) * d.y) * (((4.0 * zz) - xx) - yy)))) + (k12 * ((0.3731763362884521484375 * d.z) * (((2.0 * zz) - (3.0 * xx)) - (3.0 * yy))))) + (k13 * (((-0.4570457935333251953125) * d.x) * (((4.0 * zz) - xx) - yy)))) + (k14 * ((1.44530570507049560546875 * d.z) * (xx - yy)))) + (k15 * (((-0.590043604373931884765625) * d.x) * (xx - (3.0 * yy))));
    return _564;
}

vec3 splat_colour(vec3 d, uint row)
{
    uint param = 0u;
    uint param_1 = row;
    vec3 param_2 = sh_coefficient(param, param_1);
    vec3 colour = sh_band0(param_2);
    if (constants.sh_degree > 0u)
    {
        uint param_3 = 1u;
        uint param_4 = row;
        uint param_5 = 2u;
        uint param_6 = row;
        uint param_7 = 3u;
        uint param_8 = row;
        vec3 param_9 = d;
        vec3 param_10 = sh_coefficient(param_3, param_4);
        vec3 param_11 = sh_coefficient(param_5, param_6);
        vec3 param_12 = sh_coefficient(param_7, param_8);
        colour += sh_band1(param_9, param_10, param_11, param_12);
    }
    if (constants.sh_degree > 1u)
    {
        uint param_13 = 4u;
        uint param_14 = row;
        uint param_15 = 5u;
        uint param_16 = row;
        uint param_17 = 6u;
        uint param_18 = row;
        uint param_19 = 7u;
        uint param_20 = row;
        uint param_21 = 8u;
        uint param_22 = row;
        vec3 param_23 = d;
        vec3 param_24 = sh_coefficient(param_13, param_14);
        vec3 param_25 = sh_coefficient(param_15, param_16);
        vec3 param_26 = sh_coefficient(param_17, param_18);
        vec3 param_27 = sh_coefficient(param_19, param_20);
        vec3 param_28 = sh_coefficient(param_21, param_22);
        colour += sh_band2(param_23, param_24, param_25, param_26, param_27, param_28);
    }
    if (constants.sh_degree > 2u)
    {
        uint param_29 = 9u;
        uint param_30 = row;
        uint param_31 = 10u;
        uint param_32 = row;
        uint param_33 = 11u;
        uint param_34 = row;
        uint param_35 = 12u;
        uint param_36 = row;
        uint param_37 = 13u;
        uint param_38 = row;
        uint param_39 = 14u;
        uint param_40 = row;
        uint param_41 = 15u;
        uint param_42 = row;
        vec3 param_43 = d;
        vec3 param_44 = sh_coefficient(param_29, param_30);
        vec3 param_45 = sh_coefficient(param_31, param_32);
        vec3 param_46 = sh_coefficient(param_33, param_34);
        vec3 param_47 = sh_coefficient(param_35, param_36);
        vec3 param_48 = sh_coefficient(param_37, param_38);
        vec3 param_49 = sh_coefficient(param_39, param_40);
        vec3 param_50 = sh_coefficient(param_41, param_42);
        colour += sh_band3(param_43, param_44, param_45, param_46, param_47, param_48, param_49, param_50);
    }
    return max(colour + vec3(0.5), vec3(0.0));
}

void _project(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    vec4 mean = Splats_1._data[row];
    vec4 row0 = Splats_1._data[(2u * constants.count) + row];
    vec4 row1 = Splats_1._data[(3u * constants.count) + row];
    vec4 row2 = Splats_1._data[(4u * constants.count) + row];
    vec3 param = mean.xyz;
    vec3 param_1 = vec3(row0.w, row1.w, row2.w);
    vec4 param_2 = Splats_1._data[constants.count + row];
    SplatCamera param_3 = project_camera();
    SeenSplat seen = project_splat(param, param_1, param_2, param_3);
    if (!(seen.radius > 0.0))
    {
        Projected_1._data[row] = vec4(0.0);
        Projected_1._data[constants.count + row] = vec4(0.0);
        Projected_1._data[(2u * constants.count) + row] = vec4(0.0);
        return;
    }
    Rows3 sh_rotation;
    sh_rotation.row0 = row0.xyz;
    sh_rotation.row1 = row1.xyz;
    sh_rotation.row2 = row2.xyz;
    vec3 towards = mean.xyz - constants.eye.xyz;
    Rows3 param_4 = sh_rotation;
    vec3 param_5 = towards / vec3(length(towards));
    vec3 d = rotate_inverse(param_4, param_5);
    Projected_1._data[row] = vec4(seen.centre, seen.depth, mean.w);
    Projected_1._data[constants.count + row] = vec4(seen.conic, seen.radius);
    vec3 param_6 = d;
    uint param_7 = row;
    Projected_1._data[)~"
R"~((2u * constants.count) + row] = vec4(splat_colour(param_6, param_7), seen.clip_depth);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _project(param);
}

)~"},
{"sort_keys", R"~(#version 430
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

)~"},
{"sort_count", R"~(#version 430
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

)~"},
{"sort_scan", R"~(#version 430
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

)~"},
{"sort_scatter", R"~(#version 430
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

)~"},
{"raster_gather", R"~(#version 430
// Generated from hlsl/raster_gather.hlsl, entry raster_gather, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

layout(binding = 8, std140) uniform RasterGatherConstants
{
    uint count;
    uint begin;
    uint piece_count;
    uint first;
    uint chunk_count;
    uint reverse;
} constants;

layout(binding = 1, std430) readonly buffer Pairs
{
    uvec2 _data[];
} Pairs_1;

layout(binding = 0, std430) readonly buffer Projected
{
    vec4 _data[];
} Projected_1;

layout(binding = 2, std430) buffer Quads
{
    vec4 _data[];
} Quads_1;

void _raster_gather(uvec3 id)
{
    uint instance = id.x;
    if (instance >= constants.piece_count)
    {
        return;
    }
    uint rank = constants.begin + instance;
    uint row = Pairs_1._data[(constants.reverse != 0u) ? ((constants.count - 1u) - rank) : rank].y - constants.first;
    if (row >= constants.chunk_count)
    {
        return;
    }
    vec4 place = Projected_1._data[row];
    vec4 conic = Projected_1._data[constants.chunk_count + row];
    vec4 rgb = Projected_1._data[(2u * constants.chunk_count) + row];
    Quads_1._data[3u * instance] = vec4(place.xy, rgb.w, place.w);
    Quads_1._data[(3u * instance) + 1u] = vec4(conic.xyz, 0.0);
    Quads_1._data[(3u * instance) + 2u] = vec4(rgb.xyz, 0.0);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _raster_gather(param);
}

)~"},
{"raster_vertex", R"~(#version 430
// Generated from hlsl/raster.hlsl, entry raster_vertex, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1

struct QuadFragment
{
    vec4 position;
    vec2 centre;
    vec4 form;
    vec3 rgb;
};

layout(binding = 8, std140) uniform RasterConstants
{
    vec2 image_size;
    float flip_y;
} constants;

layout(location = 0) in vec4 quad0;
layout(location = 1) in vec4 quad1;
layout(location = 2) in vec4 quad2;
layout(location = 0) flat out vec2 _entryPointOutput_centre;
layout(location = 1) flat out vec4 _entryPointOutput_form;
layout(location = 2) flat out vec3 _entryPointOutput_rgb;

vec4 splat_form(vec3 conic, float opacity)
{
    float most = log2(opacity * 255.0);
    return vec4((-0.721347510814666748046875) * conic.x, (-1.44269502162933349609375) * conic.y, (-0.721347510814666748046875) * conic.z, most);
}

vec2 splat_corner(inout vec2 corner, vec2 centre, vec3 conic, float most, vec2 size)
{
    float reach = 1.38629436492919921875 * max(most, 0.0);
    float det = ((conic.x * conic.z) - (conic.y * conic.y)) - (3.0000001061125658452510833740234e-07 * ((conic.x * conic.z) + (conic.y * conic.y)));
    if (!(det > 0.0))
    {
        return (((corner * 0.5) + vec2(0.5)) * size) - vec2(0.5);
    }
    float mid = 0.5 * (conic.x + conic.z);
    float half_gap = 0.5 * (conic.x - conic.z);
    float larger = mid + sqrt((half_gap * half_gap) + (conic.y * conic.y));
    vec2 _158 = vec2(larger - conic.z, conic.y);
    vec2 _165 = vec2(conic.y, larger - conic.x);
    bvec2 _167 = bvec2(half_gap >= 0.0);
    vec2 axis = vec2(_167.x ? _158.x : _165.x, _167.y ? _158.y : _165.y);
    float axis_length = length(axis);
    vec2 _177 = axis / vec2(axis_length);
    bvec2 _180 = bvec2(axis_length > 0.0);
    axis = vec2(_180.x ? _177.x : vec2(1.0, 0.0).x, _180.y ? _177.y : vec2(1.0, 0.0).y);
    float across = min(sqrt(reach / larger), 1000000.0) + 0.125;
    float along = min(sqrt((reach * larger) / det), 1000000.0) + 0.125;
    if (along < 8.0)
    {
        vec2 _213 = vec2(1.73205077648162841796875 * corner.x, -1.0);
        bvec2 _216 = bvec2(corner.y < 0.0);
        corner = vec2(_216.x ? _213.x : vec2(0.0, 2.0).x, _216.y ? _213.y : vec2(0.0, 2.0).y);
    }
    return (centre + (axis * (corner.x * across))) + (vec2(-axis.y, axis.x) * (corner.y * along));
}

vec4 clip_from_pixels(vec2 pixel, float clip_depth, vec2 size, float flip_y)
{
    vec2 ndc = (((pixel * 2.0) + vec2(1.0)) / size) - vec2(1.0);
    return vec4(ndc.x, (-flip_y) * ndc.y, clip_depth, 1.0);
}

QuadFragment quad_vertex(uint vertex, vec4 place, vec3 conic, vec3 rgb)
{
    QuadFragment q;
    q.centre = place.xy + vec2(0.5);
    vec3 param = conic;
    float param_1 = place.w;
    q.form = splat_form(param, param_1);
    q.rgb = rgb;
    q.position = vec4(2.0, 2.0, 0.0, 1.0);
    if (q.form.w >= 0.0)
    {
        vec2 corner = vec2(float(((vertex & 1u) != 0u) ? 1 : (-1)), float(((vertex & 2u) != 0u) ? 1 : (-1)));
        vec2 param_2 = corner;
        vec2 param_3 = place.xy;
        vec3 param_4 = conic;
        float param_5 = q.form.w;
        vec2 param_6 = constants.image_size;
        vec2 _320 = splat_corner(param_2, param_3, param_4, param_5, param_6);
        vec2 pixel = _320;
        vec2 param_7 = pixel;
        float param_8 = place.z;
        vec2 param_9 = constants.image_size;
        float param_10 = constants.flip_y;
        q.position = clip_from_pixels(param_7, param_8, param_9, param_10);
    }
    return q;
}

QuadFragment _raster_vertex(vec4 quad0_1, vec4 quad1_1, vec4 quad2_1, uint vertex)
{
    uint param = vertex;
    vec4 param_1 = quad0_1;
    vec3 param_2 = quad1_1.xyz;
    vec3 param_3 = quad2_1.xyz;
    return quad_vertex(param, param_1, param_2, param_3);
}

void main()
{
    vec4 quad0_1 = quad0;
    vec4 quad1_1 = quad1;
    vec4 quad2_1 = quad2;
    uint vertex = uint(gl_VertexID);
    vec4 param = quad0_1;
    vec4 param_1 = quad1_1;
    vec4 param_2 = quad2_1;
    uint param_3 = vertex;
    QuadFragment flattenTemp = _raster_vertex(param, param_1, param_2, param_3);
    gl_Position = flattenTemp.position;
    _entryPointOutput_centre = flattenTemp.centre;
    _entryPointOutput_form = flattenTemp.form;
    _entryPointOutput_rgb = flattenTemp.rgb;
    gl_Position.z = 2.0 * gl_Position.z - gl_Position.w;
}

)~"},
{"raster_pixel", R"~(#version 430
// Generated from hlsl/raster.hlsl, entry raster_pixel, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1

struct QuadFragment
{
    vec4 position;
    vec2 centre;
    vec4 form;
    vec3 rgb;
};

layout(location = 0) flat in vec2 q_centre;
layout(location = 1) flat in vec4 q_form;
layout(location = 2) flat in vec3 q_rgb;
layout(location = 0) out vec4 _entryPointOutput;

float splat_level(vec2 offset, vec4 form)
{
    float power = (offset.x * ((form.x * offset.x) + (form.y * offset.y))) + ((form.z * offset.y) * offset.y);
    return (power > 0.0) ? (-1.0) : (power + form.w);
}

vec4 splat_fragment(vec3 rgb, float level)
{
    float alpha = min(0.9900000095367431640625, exp2(level) * 0.0039215688593685626983642578125);
    return vec4(rgb * alpha, alpha);
}

vec4 _raster_pixel(QuadFragment q)
{
    vec2 param = q.centre - q.position.xy;
    vec4 param_1 = q.form;
    float level = splat_level(param, param_1);
    if (level < 0.0)
    {
        discard;
    }
    vec3 param_2 = q.rgb;
    float param_3 = level;
    return splat_fragment(param_2, param_3);
}

void main()
{
    QuadFragment q;
    q.position = gl_FragCoord;
    q.centre = q_centre;
    q.form = q_form;
    q.rgb = q_rgb;
    QuadFragment param = q;
    vec4 _138 = _raster_pixel(param);
    _entryPointOutput = _138;
}

)~"},
{"composite_vertex", R"~(#version 430
// Generated from hlsl/composite.hlsl, entry composite_vertex, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1

vec4 _composite_vertex(uint vertex)
{
    return vec4(float((vertex == 1u) ? 3 : (-1)), float((vertex == 2u) ? 3 : (-1)), 0.0, 1.0);
}

void main()
{
    uint vertex = uint(gl_VertexID);
    uint param = vertex;
    gl_Position = _composite_vertex(param);
    gl_Position.z = 2.0 * gl_Position.z - gl_Position.w;
}

)~"},
{"composite_pixel", R"~(#version 430
// Generated from hlsl/composite.hlsl, entry composite_pixel, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1

layout(binding = 8, std140) uniform CompositeConstants
{
    vec4 background;
    float linear_target;
    float flip_rows;
    vec2 image_size;
} constants;

layout(binding = 0) uniform sampler2D Accumulated;

layout(location = 0) out vec4 _entryPointOutput;

vec3 linear_from_display(vec3 srgb)
{
    vec3 low = srgb / vec3(12.9200000762939453125);
    vec3 high = pow(max((srgb + vec3(0.054999999701976776123046875)) / vec3(1.05499994754791259765625), vec3(0.0)), vec3(2.400000095367431640625));
    return vec3((srgb.x <= 0.040449999272823333740234375) ? low.x : high.x, (srgb.y <= 0.040449999272823333740234375) ? low.y : high.y, (srgb.z <= 0.040449999272823333740234375) ? low.z : high.z);
}

vec4 _composite_pixel(vec4 position)
{
    float y = (constants.flip_rows != 0.0) ? (constants.image_size.y - position.y) : position.y;
    vec4 colour = texelFetch(Accumulated, ivec3(int(position.x), int(y), 0).xy, ivec3(int(position.x), int(y), 0).z);
    float left = 1.0 - colour.w;
    float alpha = colour.w + (left * constants.background.w);
    vec3 display = colour.xyz + (constants.background.xyz * (left * constants.background.w));
    if (constants.linear_target != 0.0)
    {
        vec3 _154 = display / vec3(alpha);
        bvec3 _157 = bvec3(alpha > 0.0);
        vec3 straight = vec3(_157.x ? _154.x : display.x, _157.y ? _154.y : display.y, _157.z ? _154.z : display.z);
        vec3 param = straight;
        display = linear_from_display(param) * alpha;
    }
    return vec4(display, alpha);
}

void main()
{
    vec4 position = gl_FragCoord;
    vec4 param = position;
    _entryPointOutput = _composite_pixel(param);
}

)~"},
};
const uint32_t glsl430_text_count = 18;

}  // namespace avatar
