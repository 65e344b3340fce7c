// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.
#include "shader_texts.h"

namespace avatar {

const ShaderText msl_texts[] = {
{"morph", R"~(// Generated from hlsl/morph.hlsl, entry morph, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct MorphStatic
{
    uint _data[1];
};

struct MorphConstants
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
};

struct Pose
{
    float _data[1];
};

struct Mesh
{
    float4 _data[1];
};

static inline __attribute__((always_inline))
uint packed_element(thread const uint& word, thread const uint& bit, thread const uint& width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

static inline __attribute__((always_inline))
uint morph_code(thread const uint& section, thread const uint& index, thread const uint& width, const device MorphStatic& MorphStatic_1)
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

static inline __attribute__((always_inline))
float morph_linear(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& scale, const device MorphStatic& MorphStatic_1)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = morph_code(param, param_1, param_2, MorphStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    return as_type<float>(MorphStatic_1._data[scale]) + (as_type<float>(MorphStatic_1._data[scale + 1u]) * float(code));
}

static inline __attribute__((always_inline))
float3 morph_linear3(thread const uint& section, thread const uint& index, thread const uint& stride, thread const uint& width, thread const uint& scale, const device MorphStatic& MorphStatic_1)
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
    return float3(morph_linear(param, param_1, param_2, param_3, MorphStatic_1), morph_linear(param_4, param_5, param_6, param_7, MorphStatic_1), morph_linear(param_8, param_9, param_10, param_11, MorphStatic_1));
}

static inline __attribute__((always_inline))
float packed_step_count(thread const uint& code, thread const uint& width)
{
    return float(code) - float(1u << (width - 1u));
}

static inline __attribute__((always_inline))
float morph_signed(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& _step, const device MorphStatic& MorphStatic_1)
{
    if (width == 0u)
    {
        return 0.0;
    }
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = morph_code(param, param_1, param_2, MorphStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    uint param_3 = code;
    uint param_4 = width;
    return as_type<float>(MorphStatic_1._data[_step]) * packed_step_count(param_3, param_4);
}

static inline __attribute__((always_inline))
float3 morph_signed3(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& _step, const device MorphStatic& MorphStatic_1)
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
    return float3(morph_signed(param, param_1, param_2, param_3, MorphStatic_1), morph_signed(param_4, param_5, param_6, param_7, MorphStatic_1), morph_signed(param_8, param_9, param_10, param_11, MorphStatic_1));
}

static inline __attribute__((always_inline))
float3 morph_add(thread const float3& position, thread const float& weight, thread const float3& delta)
{
    return position + (delta * weight);
}

static inline __attribute__((always_inline))
float3 morphed(thread float3& position, thread const uint& row, const device MorphStatic& MorphStatic_1, constant MorphConstants& constants, const device Pose& Pose_1)
{
    uint end = MorphStatic_1._data[(constants.morph_ptr + row) + 1u];
    uint _296 = constants.morph_ptr + row;
    for (uint e = MorphStatic_1._data[_296]; e < end; e++)
    {
        uint param = constants.morph_column;
        uint param_1 = e;
        uint param_2 = constants.morph_column_width;
        uint column = morph_code(param, param_1, param_2, MorphStatic_1);
        float weight = Pose_1._data[constants.weights + column];
        if (weight != 0.0)
        {
            uint _step = constants.morph_position_step + (3u * column);
            uint param_3 = constants.morph_position;
            uint param_4 = 3u * e;
            uint param_5 = constants.morph_position_width;
            uint param_6 = _step;
            float3 param_7 = position;
            float param_8 = weight;
            float3 param_9 = morph_signed3(param_3, param_4, param_5, param_6, MorphStatic_1);
            position = morph_add(param_7, param_8, param_9);
        }
    }
    return position;
}

static inline __attribute__((always_inline))
float3 corrected(thread float3& position, thread const uint& row, const device MorphStatic& MorphStatic_1, constant MorphConstants& constants, const device Pose& Pose_1)
{
    uint end = MorphStatic_1._data[(constants.corrective_ptr + row) + 1u];
    uint _383 = constants.corrective_ptr + row;
    for (uint e = MorphStatic_1._data[_383]; e < end; e++)
    {
        uint param = constants.corrective_column;
        uint param_1 = e;
        uint param_2 = constants.corrective_column_width;
        uint column = morph_code(param, param_1, param_2, MorphStatic_1);
        float feature = Pose_1._data[constants.features + column];
        if (feature != 0.0)
        {
            uint _step = constants.corrective_position_step + (3u * column);
            uint param_3 = constants.corrective_position;
            uint param_4 = 3u * e;
            uint param_5 = constants.corrective_position_width;
            uint param_6 = _step;
            float3 param_7 = position;
            float param_8 = feature;
            float3 param_9 = morph_signed3(param_3, param_4, param_5, param_6, MorphStatic_1);
            position = morph_add(param_7, param_8, param_9);
        }
    }
    return position;
}

static inline __attribute__((always_inline))
void _morph(thread const uint3& id, const device MorphStatic& MorphStatic_1, constant MorphConstants& constants, const device Pose& Pose_1, device Mesh& Mesh_1)
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
    float3 position = morph_linear3(param, param_1, param_2, param_3, param_4, MorphStatic_1);
    float3 param_5 = position;
    uint param_6 = row;
    float3 _491 = morphed(param_5, param_6, MorphStatic_1, constants, Pose_1);
    float3 param_7 = _491;
    uint param_8 = row;
    float3 _495 = corrected(param_7, param_8, MorphStatic_1, constants, Pose_1);
    Mesh_1._data[constants.first + row] = float4(_495, 1.0);
}

kernel void morph(const device MorphStatic& MorphStatic_1 [[buffer(0)]], const device Pose& Pose_1 [[buffer(1)]], device Mesh& Mesh_1 [[buffer(2)]], constant MorphConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _morph(param, MorphStatic_1, constants, Pose_1, Mesh_1);
}

)~"},
{"skin", R"~(// Generated from hlsl/skin.hlsl, entry skin, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct Rows4
{
    float4 row0;
    float4 row1;
    float4 row2;
};

struct SkinStatic
{
    uint _data[1];
};

struct SkinConstants
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
};

struct Pose
{
    float _data[1];
};

struct Mesh
{
    float4 _data[1];
};

static inline __attribute__((always_inline))
Rows4 skin_none()
{
    Rows4 sum;
    sum.row0 = float4(0.0);
    sum.row1 = float4(0.0);
    sum.row2 = float4(0.0);
    return sum;
}

static inline __attribute__((always_inline))
uint packed_element(thread const uint& word, thread const uint& bit, thread const uint& width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

static inline __attribute__((always_inline))
uint skinned_code(thread const uint& section, thread const uint& index, thread const uint& width, const device SkinStatic& SkinStatic_1)
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

static inline __attribute__((always_inline))
float skinned_weight(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& _step, const device SkinStatic& SkinStatic_1)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = skinned_code(param, param_1, param_2, SkinStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    return as_type<float>(SkinStatic_1._data[_step]) * float(code);
}

static inline __attribute__((always_inline))
Rows4 skin_joint(thread const uint& joint, constant SkinConstants& constants, const device Pose& Pose_1)
{
    uint at = constants.joints + (12u * joint);
    Rows4 m;
    m.row0 = float4(Pose_1._data[at], Pose_1._data[at + 1u], Pose_1._data[at + 2u], Pose_1._data[at + 3u]);
    m.row1 = float4(Pose_1._data[at + 4u], Pose_1._data[at + 5u], Pose_1._data[at + 6u], Pose_1._data[at + 7u]);
    m.row2 = float4(Pose_1._data[at + 8u], Pose_1._data[at + 9u], Pose_1._data[at + 10u], Pose_1._data[at + 11u]);
    return m;
}

static inline __attribute__((always_inline))
Rows4 skin_add(thread Rows4& sum, thread const float& weight, thread const Rows4& joint)
{
    sum.row0 += (joint.row0 * weight);
    sum.row1 += (joint.row1 * weight);
    sum.row2 += (joint.row2 * weight);
    return sum;
}

static inline __attribute__((always_inline))
float3 transform_point(thread const Rows4& m, thread const float3& p)
{
    return float3((((m.row0.x * p.x) + (m.row0.y * p.y)) + (m.row0.z * p.z)) + m.row0.w, (((m.row1.x * p.x) + (m.row1.y * p.y)) + (m.row1.z * p.z)) + m.row1.w, (((m.row2.x * p.x) + (m.row2.y * p.y)) + (m.row2.z * p.z)) + m.row2.w);
}

static inline __attribute__((always_inline))
float packed_step_count(thread const uint& code, thread const uint& width)
{
    return float(code) - float(1u << (width - 1u));
}

static inline __attribute__((always_inline))
float skinned_signed(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& _step, const device SkinStatic& SkinStatic_1)
{
    if (width == 0u)
    {
        return 0.0;
    }
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = skinned_code(param, param_1, param_2, SkinStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    uint param_3 = code;
    uint param_4 = width;
    return as_type<float>(SkinStatic_1._data[_step]) * packed_step_count(param_3, param_4);
}

static inline __attribute__((always_inline))
float3 skinned_signed3(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& _step, const device SkinStatic& SkinStatic_1)
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
    return float3(skinned_signed(param, param_1, param_2, param_3, SkinStatic_1), skinned_signed(param_4, param_5, param_6, param_7, SkinStatic_1), skinned_signed(param_8, param_9, param_10, param_11, SkinStatic_1));
}

static inline __attribute__((always_inline))
float3 late_add(thread const float3& posed, thread const float& weight, thread const float3& delta)
{
    return posed + (delta * weight);
}

static inline __attribute__((always_inline))
void _skin(thread const uint3& id, const device SkinStatic& SkinStatic_1, constant SkinConstants& constants, const device Pose& Pose_1, device Mesh& Mesh_1)
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
        float weight = skinned_weight(param, param_1, param_2, param_3, SkinStatic_1);
        uint param_4 = constants.skin_column;
        uint param_5 = e;
        uint param_6 = constants.skin_column_width;
        uint param_7 = skinned_code(param_4, param_5, param_6, SkinStatic_1);
        Rows4 param_8 = blended;
        float param_9 = weight;
        Rows4 param_10 = skin_joint(param_7, constants, Pose_1);
        Rows4 _493 = skin_add(param_8, param_9, param_10);
        blended = _493;
    }
    Rows4 param_11 = blended;
    float3 param_12 = Mesh_1._data[constants.first + row].xyz;
    float3 posed = transform_point(param_11, param_12);
    uint late_end = SkinStatic_1._data[(constants.late_ptr + row) + 1u];
    uint _525 = constants.late_ptr + row;
    for (uint l = SkinStatic_1._data[_525]; l < late_end; l++)
    {
        uint param_13 = constants.late_column;
        uint param_14 = l;
        uint param_15 = constants.late_column_width;
        uint column = skinned_code(param_13, param_14, param_15, SkinStatic_1);
        uint param_16 = constants.late_position;
        uint param_17 = 3u * l;
        uint param_18 = constants.late_position_width;
        uint param_19 = constants.late_position_step + (3u * column);
        float3 delta = skinned_signed3(param_16, param_17, param_18, param_19, SkinStatic_1);
        float3 param_20 = posed;
        float param_21 = Pose_1._data[constants.late + column];
        float3 param_22 = delta;
        posed = late_add(param_20, param_21, param_22);
    }
    Mesh_1._data[constants.first + row] = float4(posed, 1.0);
}

kernel void skin(const device SkinStatic& SkinStatic_1 [[buffer(0)]], const device Pose& Pose_1 [[buffer(1)]], device Mesh& Mesh_1 [[buffer(2)]], constant SkinConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _skin(param, SkinStatic_1, constants, Pose_1, Mesh_1);
}

)~"},
{"blend", R"~(// Generated from hlsl/blend.hlsl, entry blend, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct BlendGeometry
{
    float3 mean;
    float4 quat_wxyz;
};

struct BlendAppearance
{
    float3 log_scale;
    float opacity_logit;
};

struct BlendStatic
{
    uint _data[1];
};

struct BlendConstants
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
};

struct Pose
{
    float _data[1];
};

struct Sh
{
    float _data[1];
};

struct Splats
{
    float4 _data[1];
};

static inline __attribute__((always_inline))
uint packed_element(thread const uint& word, thread const uint& bit, thread const uint& width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

static inline __attribute__((always_inline))
uint blend_code(thread const uint& section, thread const uint& index, thread const uint& width, const device BlendStatic& BlendStatic_1)
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

static inline __attribute__((always_inline))
float blend_linear(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& scale, const device BlendStatic& BlendStatic_1)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = blend_code(param, param_1, param_2, BlendStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    return as_type<float>(BlendStatic_1._data[scale]) + (as_type<float>(BlendStatic_1._data[scale + 1u]) * float(code));
}

static inline __attribute__((always_inline))
float3 blend_linear3(thread const uint& section, thread const uint& index, thread const uint& stride, thread const uint& width, thread const uint& scale, const device BlendStatic& BlendStatic_1)
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
    return float3(blend_linear(param, param_1, param_2, param_3, BlendStatic_1), blend_linear(param_4, param_5, param_6, param_7, BlendStatic_1), blend_linear(param_8, param_9, param_10, param_11, BlendStatic_1));
}

static inline __attribute__((always_inline))
float packed_step_count(thread const uint& code, thread const uint& width)
{
    return float(code) - float(1u << (width - 1u));
}

static inline __attribute__((always_inline))
float blend_signed(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& _step, const device BlendStatic& BlendStatic_1)
{
    if (width == 0u)
    {
        return 0.0;
    }
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = blend_code(param, param_1, param_2, BlendStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    uint param_3 = code;
    uint param_4 = width;
    return as_type<float>(BlendStatic_1._data[_step]) * packed_step_count(param_3, param_4);
}

static inline __attribute__((always_inline))
float3 blend_signed3(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& _step, const device BlendStatic& BlendStatic_1)
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
    return float3(blend_signed(param, param_1, param_2, param_3, BlendStatic_1), blend_signed(param_4, param_5, param_6, param_7, BlendStatic_1), blend_signed(param_8, param_9, param_10, param_11, BlendStatic_1));
}

static inline __attribute__((always_inline))
BlendGeometry blend_geometry(thread BlendGeometry& g, thread const float& weight, thread const float3& mean, thread const float4& quat_wxyz)
{
    g.mean += (mean * weight);
    g.quat_wxyz += (quat_wxyz * weight);
    return g;
}

static inline __attribute__((always_inline))
BlendGeometry blended_geometry(thread const uint& row, const device BlendStatic& BlendStatic_1, constant BlendConstants& constants, const device Pose& Pose_1)
{
    uint param = constants.base_mean;
    uint param_1 = row;
    uint param_2 = constants.count;
    uint param_3 = constants.base_mean_width;
    uint param_4 = constants.base_mean_scale;
    BlendGeometry g;
    g.mean = blend_linear3(param, param_1, param_2, param_3, param_4, BlendStatic_1);
    uint param_5 = constants.base_quat;
    uint param_6 = row;
    uint param_7 = constants.base_quat_width;
    uint param_8 = constants.base_quat_scale;
    uint param_9 = constants.base_quat;
    uint param_10 = constants.count + row;
    uint param_11 = constants.count;
    uint param_12 = constants.base_quat_width;
    uint param_13 = constants.base_quat_scale + 2u;
    g.quat_wxyz = float4(blend_linear(param_5, param_6, param_7, param_8, BlendStatic_1), blend_linear3(param_9, param_10, param_11, param_12, param_13, BlendStatic_1));
    uint end = BlendStatic_1._data[(constants.geometry_ptr + row) + 1u];
    uint _481 = constants.geometry_ptr + row;
    for (uint e = BlendStatic_1._data[_481]; e < end; e++)
    {
        uint param_14 = constants.geometry_column;
        uint param_15 = e;
        uint param_16 = constants.geometry_column_width;
        uint column = blend_code(param_14, param_15, param_16, BlendStatic_1);
        float weight = Pose_1._data[constants.weights + column];
        if (weight != 0.0)
        {
            uint param_17 = constants.geometry_mean;
            uint param_18 = 3u * e;
            uint param_19 = constants.geometry_mean_width;
            uint param_20 = constants.geometry_mean_step + (3u * column);
            float3 mean = blend_signed3(param_17, param_18, param_19, param_20, BlendStatic_1);
            uint _step = constants.geometry_quat_step + (4u * column);
            uint param_21 = constants.geometry_quat;
            uint param_22 = 4u * e;
            uint param_23 = constants.geometry_quat_width;
            uint param_24 = _step;
            uint param_25 = constants.geometry_quat;
            uint param_26 = (4u * e) + 1u;
            uint param_27 = constants.geometry_quat_width;
            uint param_28 = _step + 1u;
            float4 quat_wxyz = float4(blend_signed(param_21, param_22, param_23, param_24, BlendStatic_1), blend_signed3(param_25, param_26, param_27, param_28, BlendStatic_1));
            BlendGeometry param_29 = g;
            float param_30 = weight;
            float3 param_31 = mean;
            float4 param_32 = quat_wxyz;
            BlendGeometry _590 = blend_geometry(param_29, param_30, param_31, param_32);
            g = _590;
        }
    }
    return g;
}

static inline __attribute__((always_inline))
float blend_table(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& table, const device BlendStatic& BlendStatic_1)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = blend_code(param, param_1, param_2, BlendStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    return as_type<float>(BlendStatic_1._data[table + code]);
}

static inline __attribute__((always_inline))
BlendAppearance blend_appearance(thread BlendAppearance& a, thread const float& weight, thread const float3& log_scale, thread const float& opacity_logit)
{
    a.log_scale += (log_scale * weight);
    a.opacity_logit += (weight * opacity_logit);
    return a;
}

static inline __attribute__((always_inline))
BlendAppearance blended_appearance(thread const uint& row, const device BlendStatic& BlendStatic_1, constant BlendConstants& constants, const device Pose& Pose_1)
{
    uint param = constants.base_log_scale;
    uint param_1 = row;
    uint param_2 = constants.count;
    uint param_3 = constants.base_log_scale_width;
    uint param_4 = constants.base_log_scale_scale;
    BlendAppearance a;
    a.log_scale = blend_linear3(param, param_1, param_2, param_3, param_4, BlendStatic_1);
    uint param_5 = constants.base_opacity;
    uint param_6 = row;
    uint param_7 = constants.base_opacity_width;
    uint param_8 = constants.base_opacity_table;
    a.opacity_logit = blend_table(param_5, param_6, param_7, param_8, BlendStatic_1);
    uint end = BlendStatic_1._data[(constants.appearance_ptr + row) + 1u];
    uint _645 = constants.appearance_ptr + row;
    for (uint e = BlendStatic_1._data[_645]; e < end; e++)
    {
        uint param_9 = constants.appearance_column;
        uint param_10 = e;
        uint param_11 = constants.appearance_column_width;
        uint column = blend_code(param_9, param_10, param_11, BlendStatic_1);
        float weight = Pose_1._data[constants.weights + column];
        if (weight != 0.0)
        {
            uint param_12 = constants.appearance_log_scale;
            uint param_13 = 3u * e;
            uint param_14 = constants.appearance_log_scale_width;
            uint param_15 = constants.appearance_log_scale_step + (3u * column);
            float3 log_scale = blend_signed3(param_12, param_13, param_14, param_15, BlendStatic_1);
            uint param_16 = constants.appearance_opacity;
            uint param_17 = e;
            uint param_18 = constants.appearance_opacity_width;
            uint param_19 = constants.appearance_opacity_step + column;
            float opacity_logit = blend_signed(param_16, param_17, param_18, param_19, BlendStatic_1);
            BlendAppearance param_20 = a;
            float param_21 = weight;
            float3 param_22 = log_scale;
            float param_23 = opacity_logit;
            BlendAppearance _725 = blend_appearance(param_20, param_21, param_22, param_23);
            a = _725;
        }
    }
    return a;
}

static inline __attribute__((always_inline))
float3 blend_base_sh(thread const uint& t, thread const uint& row, const device BlendStatic& BlendStatic_1, constant BlendConstants& constants)
{
    uint param = constants.base_sh;
    uint param_1 = (t * constants.count) + row;
    uint param_2 = constants.count;
    uint param_3 = constants.base_sh_width;
    uint param_4 = constants.base_sh_scale + (2u * t);
    return blend_linear3(param, param_1, param_2, param_3, param_4, BlendStatic_1);
}

static inline __attribute__((always_inline))
float3 blend_sh(thr)~"
R"~(ead const float3& coefficient, thread const float& weight, thread const float3& delta)
{
    return coefficient + (delta * weight);
}

static inline __attribute__((always_inline))
void blend_store_sh(thread const uint& k, thread const uint& row, thread const float3& coefficient, constant BlendConstants& constants, device Sh& Sh_1)
{
    if (k < constants.sh_terms)
    {
        uint at = ((3u * k) * constants.count) + row;
        Sh_1._data[at] = coefficient.x;
        Sh_1._data[at + constants.count] = coefficient.y;
        Sh_1._data[at + (2u * constants.count)] = coefficient.z;
    }
}

static inline __attribute__((always_inline))
void blend_sh_from(thread const uint& k, thread const uint& row, const device BlendStatic& BlendStatic_1, constant BlendConstants& constants, const device Pose& Pose_1, device Sh& Sh_1)
{
    uint last = constants.sh_terms - 1u;
    uint terms = 3u * constants.sh_terms;
    uint t0 = 3u * k;
    uint t1 = 3u * min((k + 1u), last);
    uint t2 = 3u * min((k + 2u), last);
    uint t3 = 3u * min((k + 3u), last);
    uint param = t0;
    uint param_1 = row;
    float3 c0 = blend_base_sh(param, param_1, BlendStatic_1, constants);
    uint param_2 = t1;
    uint param_3 = row;
    float3 c1 = blend_base_sh(param_2, param_3, BlendStatic_1, constants);
    uint param_4 = t2;
    uint param_5 = row;
    float3 c2 = blend_base_sh(param_4, param_5, BlendStatic_1, constants);
    uint param_6 = t3;
    uint param_7 = row;
    float3 c3 = blend_base_sh(param_6, param_7, BlendStatic_1, constants);
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
        uint column = blend_code(param_8, param_9, param_10, BlendStatic_1);
        float weight = Pose_1._data[constants.weights + column];
        if (weight != 0.0)
        {
            uint at = terms * e;
            uint _step = constants.appearance_sh_step + (terms * column);
            uint param_11 = constants.appearance_sh;
            uint param_12 = at + t0;
            uint param_13 = constants.appearance_sh_width;
            uint param_14 = _step + t0;
            float3 param_15 = c0;
            float param_16 = weight;
            float3 param_17 = blend_signed3(param_11, param_12, param_13, param_14, BlendStatic_1);
            c0 = blend_sh(param_15, param_16, param_17);
            uint param_18 = constants.appearance_sh;
            uint param_19 = at + t1;
            uint param_20 = constants.appearance_sh_width;
            uint param_21 = _step + t1;
            float3 param_22 = c1;
            float param_23 = weight;
            float3 param_24 = blend_signed3(param_18, param_19, param_20, param_21, BlendStatic_1);
            c1 = blend_sh(param_22, param_23, param_24);
            uint param_25 = constants.appearance_sh;
            uint param_26 = at + t2;
            uint param_27 = constants.appearance_sh_width;
            uint param_28 = _step + t2;
            float3 param_29 = c2;
            float param_30 = weight;
            float3 param_31 = blend_signed3(param_25, param_26, param_27, param_28, BlendStatic_1);
            c2 = blend_sh(param_29, param_30, param_31);
            uint param_32 = constants.appearance_sh;
            uint param_33 = at + t3;
            uint param_34 = constants.appearance_sh_width;
            uint param_35 = _step + t3;
            float3 param_36 = c3;
            float param_37 = weight;
            float3 param_38 = blend_signed3(param_32, param_33, param_34, param_35, BlendStatic_1);
            c3 = blend_sh(param_36, param_37, param_38);
        }
    }
    uint param_39 = k;
    uint param_40 = row;
    float3 param_41 = c0;
    blend_store_sh(param_39, param_40, param_41, constants, Sh_1);
    uint param_42 = k + 1u;
    uint param_43 = row;
    float3 param_44 = c1;
    blend_store_sh(param_42, param_43, param_44, constants, Sh_1);
    uint param_45 = k + 2u;
    uint param_46 = row;
    float3 param_47 = c2;
    blend_store_sh(param_45, param_46, param_47, constants, Sh_1);
    uint param_48 = k + 3u;
    uint param_49 = row;
    float3 param_50 = c3;
    blend_store_sh(param_48, param_49, param_50, constants, Sh_1);
}

static inline __attribute__((always_inline))
void _blend(thread const uint3& id, const device BlendStatic& BlendStatic_1, constant BlendConstants& constants, const device Pose& Pose_1, device Sh& Sh_1, device Splats& Splats_1)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    uint param = row;
    BlendGeometry g = blended_geometry(param, BlendStatic_1, constants, Pose_1);
    uint param_1 = row;
    BlendAppearance a = blended_appearance(param_1, BlendStatic_1, constants, Pose_1);
    Splats_1._data[row] = float4(g.mean, a.opacity_logit);
    Splats_1._data[constants.count + row] = g.quat_wxyz;
    Splats_1._data[(2u * constants.count) + row] = float4(1.0, 0.0, 0.0, a.log_scale.x);
    Splats_1._data[(3u * constants.count) + row] = float4(0.0, 1.0, 0.0, a.log_scale.y);
    Splats_1._data[(4u * constants.count) + row] = float4(0.0, 0.0, 1.0, a.log_scale.z);
    for (uint k = 0u; k < constants.sh_terms; k += 4u)
    {
        uint param_2 = k;
        uint param_3 = row;
        blend_sh_from(param_2, param_3, BlendStatic_1, constants, Pose_1, Sh_1);
    }
}

kernel void blend(const device BlendStatic& BlendStatic_1 [[buffer(0)]], const device Pose& Pose_1 [[buffer(1)]], device Splats& Splats_1 [[buffer(2)]], device Sh& Sh_1 [[buffer(3)]], constant BlendConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _blend(param, BlendStatic_1, constants, Pose_1, Sh_1, Splats_1);
}

)~"},
{"bind_skin", R"~(// Generated from hlsl/bind_skin.hlsl, entry bind_skin, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct Rows3
{
    float3 row0;
    float3 row1;
    float3 row2;
};

struct Rows4
{
    float4 row0;
    float4 row1;
    float4 row2;
};

struct BoundSplat
{
    float3 mean;
    float4 quat_wxyz;
    Rows3 sh_rotation;
};

struct BindStatic
{
    uint _data[1];
};

struct BindSkinConstants
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
    float4 group_matrix_row0;
    float4 group_matrix_row1;
    float4 group_matrix_row2;
    float4 group_rotation_row0;
    float4 group_rotation_row1;
    float4 group_rotation_row2;
    float4 world_row0;
    float4 world_row1;
    float4 world_row2;
    float4 world_quat_wxyz;
};

struct Pose
{
    float _data[1];
};

struct Splats
{
    float4 _data[1];
};

static inline __attribute__((always_inline))
Rows4 skin_none()
{
    Rows4 sum;
    sum.row0 = float4(0.0);
    sum.row1 = float4(0.0);
    sum.row2 = float4(0.0);
    return sum;
}

static inline __attribute__((always_inline))
uint packed_element(thread const uint& word, thread const uint& bit, thread const uint& width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

static inline __attribute__((always_inline))
uint bind_code(thread const uint& section, thread const uint& index, thread const uint& width, const device BindStatic& BindStatic_1)
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

static inline __attribute__((always_inline))
float bind_weight(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& _step, const device BindStatic& BindStatic_1)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = bind_code(param, param_1, param_2, BindStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    return as_type<float>(BindStatic_1._data[_step]) * float(code);
}

static inline __attribute__((always_inline))
Rows4 skin_add(thread Rows4& sum, thread const float& weight, thread const Rows4& joint)
{
    sum.row0 += (joint.row0 * weight);
    sum.row1 += (joint.row1 * weight);
    sum.row2 += (joint.row2 * weight);
    return sum;
}

static inline __attribute__((always_inline))
Rows4 bind_skin_matrix(thread const uint& row, const device BindStatic& BindStatic_1, constant BindSkinConstants& constants, const device Pose& Pose_1)
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
        uint at = constants.joints + (12u * bind_code(param, param_1, param_2, BindStatic_1));
        m.row0 = float4(Pose_1._data[at], Pose_1._data[at + 1u], Pose_1._data[at + 2u], Pose_1._data[at + 3u]);
        m.row1 = float4(Pose_1._data[at + 4u], Pose_1._data[at + 5u], Pose_1._data[at + 6u], Pose_1._data[at + 7u]);
        m.row2 = float4(Pose_1._data[at + 8u], Pose_1._data[at + 9u], Pose_1._data[at + 10u], Pose_1._data[at + 11u]);
        uint param_3 = constants.skin_weight;
        uint param_4 = e;
        uint param_5 = constants.skin_weight_width;
        uint param_6 = constants.skin_weight_step;
        Rows4 param_7 = blended;
        float param_8 = bind_weight(param_3, param_4, param_5, param_6, BindStatic_1);
        Rows4 param_9 = m;
        Rows4 _1133 = skin_add(param_7, param_8, param_9);
        blended = _1133;
    }
    return blended;
}

static inline __attribute__((always_inline))
Rows3 linear_part(thread const Rows4& m)
{
    Rows3 r;
    r.row0 = m.row0.xyz;
    r.row1 = m.row1.xyz;
    r.row2 = m.row2.xyz;
    return r;
}

static inline __attribute__((always_inline))
Rows3 polar(thread Rows3& m)
{
    for (int _step = 0; _step < 3; _step++)
    {
        float3 c0 = cross(m.row1, m.row2);
        float3 c1 = cross(m.row2, m.row0);
        float3 c2 = cross(m.row0, m.row1);
        float determinant = dot(m.row0, c0);
        m.row0 = (m.row0 + (c0 / float3(determinant))) * 0.5;
        m.row1 = (m.row1 + (c1 / float3(determinant))) * 0.5;
        m.row2 = (m.row2 + (c2 / float3(determinant))) * 0.5;
    }
    return m;
}

static inline __attribute__((always_inline))
float packed_step_count(thread const uint& code, thread const uint& width)
{
    return float(code) - float(1u << (width - 1u));
}

static inline __attribute__((always_inline))
float bind_signed(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& _step, const device BindStatic& BindStatic_1)
{
    if (width == 0u)
    {
        return 0.0;
    }
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = bind_code(param, param_1, param_2, BindStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    uint param_3 = code;
    uint param_4 = width;
    return as_type<float>(BindStatic_1._data[_step]) * packed_step_count(param_3, param_4);
}

static inline __attribute__((always_inline))
float3 bind_signed3(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& _step, const device BindStatic& BindStatic_1)
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
    return float3(bind_signed(param, param_1, param_2, param_3, BindStatic_1), bind_signed(param_4, param_5, param_6, param_7, BindStatic_1), bind_signed(param_8, param_9, param_10, param_11, BindStatic_1));
}

static inline __attribute__((always_inline))
float3 bind_corrected(thread float3& mean, thread const uint& row, const device BindStatic& BindStatic_1, constant BindSkinConstants& constants, const device Pose& Pose_1)
{
    uint end = BindStatic_1._data[(constants.corrective_ptr + row) + 1u];
    uint _868 = constants.corrective_ptr + row;
    for (uint e = BindStatic_1._data[_868]; e < end; e++)
    {
        uint param = constants.corrective_column;
        uint param_1 = e;
        uint param_2 = constants.corrective_column_width;
        uint column = bind_code(param, param_1, param_2, BindStatic_1);
        uint _step = constants.corrective_mean_step + (3u * column);
        uint param_3 = constants.corrective_mean;
        uint param_4 = 3u * e;
        uint param_5 = constants.corrective_mean_width;
        uint param_6 = _step;
        mean += (bind_signed3(param_3, param_4, param_5, param_6, BindStatic_1) * Pose_1._data[constants.features + column]);
    }
    return mean;
}

static inline __attribute__((always_inline))
float3 late_add(thread const float3& posed, thread const float& weight, thread const float3& delta)
{
    return posed + (delta * weight);
}

static inline __attribute__((always_inline))
float3 bind_late(thread const uint& row, const device BindStatic& BindStatic_1, constant BindSkinConstants& constants, const device Pose& Pose_1)
{
    float3 sum = float3(0.0);
    uint end = BindStatic_1._data[(constants.late_ptr + row) + 1u];
    uint _946 = constants.late_ptr + row;
    for (uint e = BindStatic_1._data[_946]; e < end; e++)
    {
        uint param = constants.late_column;
        uint param_1 = e;
        uint param_2 = constants.late_column_width;
        uint column = bind_code(param, param_1, param_2, BindStatic_1);
        uint param_3 = constants.late_mean;
        uint param_4 = 3u * e;
        uint param_5 = constants.late_mean_width;
        uint param_6 = constants.late_mean_step + (3u * column);
        float3 delta = bind_signed3(param_3, param_4, param_5, param_6, BindStatic_1);
        float3 param_7 = sum;
        float param_8 = Pose_1._data[constants.late + column];
        float3 param_9 = delta;
        sum = late_add(param_7, param_8, param_9);
    }
    return sum;
}

static inline __attribute__((always_inline))
float3 transform_point(thread const Rows4& m, thread const float3& p)
{
    return float3((((m.row0.x * p.x) + (m.row0.y * p.y)) + (m.row0.z * p.z)) + m.row0.w, (((m.row1.x * p.x) + (m.row1.y * p.y)) + (m.row1.z * p.z)) + m.row1.w, (((m.row2.x * p.x) + (m.row2.y * p.y)) + (m.row2.z * p.z)) + m.row2.w);
}

static inline __attribute__((always_inline))
float4 quat_from_matrix(thread const Rows3& m)
{
    float d0 = m.row0.x;
    float d1 = m.row1.y;
    float d2 = m.row2.z;
    float4 size = sqrt(fast::max(float4(((1.0 + d0) + d1) + d2, ((1.0 + d0) - d1) - d2, ((1.0 - d0) + d1) - d2, ((1.0 - d0) - d1) + d2), float4(0.0)));
    float a = m.row2.y - m.row1.z;
    float b = m.row0.z - m.row2.x;
    float c = m.row1.x - m.row0.y;
    float d = m.row1.x + m.row0.y;
    float e = m.row0.z + m.row2.x;
    float f = m.row2.y + m.row1.z;
    if (((size.x >= size.y) && (size.x >= size.z)) && (size.x >= size.w))
    {
        return float4(size.x * size.x, a, b, c) / float4(2.0 * size.x);
    }
    if ((size.y >= size.z) && (size.y >= size.w))
    {
        return float4(a, size.y * size.y, d, e) / float4(2.0 * size.y);
    }
    if (size.z >= size.w)
    {
        return float4(b, d, size.z * size.z, f) / float4(2.0 * size.z);
    }
    return float4(c, e, f, size.w * size.w) / float4(2.0 * size.w);
}

static inline __attribute__((always_inline))
float4 quat_multiply(thread const float4& a, thread const float4& b)
{
    return float4((((a.x * b.x) - (a.y * b.y)) - (a.z * b.z)) - (a.w * b.w), (((a.x * b.y) + (a.y * b.x)) + (a.z * b.w)) - (a.w * b.z), (((a.x * b.z) - (a.y * b.w)) + (a.z * b.x)) + (a.w * b.y), (((a.x * b.w) + (a.y * b.z)) - (a.z * b.y)) + (a.w * b.x));
}

static inline __attribute__((always_inline))
BoundSplat bind_by_matrix(thread const Rows4& transform, thread const Rows3& rotation, thread const float3& mean, thread const float3& late, thread const float4& quat_wxyz)
{
    Rows4 param = transform;
    float3 param_1 = mean;
    BoundSplat b;
    b.mean = transform_point(param, param_1) + late;
    Rows3 param_2 = rotation;
    float4 param_3 = quat_from_matrix(param_2);
    float4 param_4 = quat_wxyz;
    b.quat_wxyz = quat_multiply(param_3, param_4);
    b.sh_rotation = rotation;
    return b;
}

static inline __attribute__((always_inline))
Rows3 identity_rows()
{
    Rows3 r;
    r.row0 = float3(1.0, 0.0, 0.0);
    r.row1 = float3(0.0, 1.0, 0.0);
    r.row2 = float3(0.0, 0.0, 1.0);
    return r;
}

static inline __attribute__((always_inline))
float3 rotate_inverse(thread const Rows3& m, thread const float3& v)
{
    return ((m.row0 * v.x) + (m.row1 * v.y)) + (m.row2 * v.z);
}

static inline __attribute__((always_inline))
Rows3 multiply(thread const Rows3& a, thread const Rows3& b)
{
    Rows3 param = b;
    float3 param_1 = a.row0;
    Ro)~"
R"~(ws3 r;
    r.row0 = rotate_inverse(param, param_1);
    Rows3 param_2 = b;
    float3 param_3 = a.row1;
    r.row1 = rotate_inverse(param_2, param_3);
    Rows3 param_4 = b;
    float3 param_5 = a.row2;
    r.row2 = rotate_inverse(param_4, param_5);
    return r;
}

static inline __attribute__((always_inline))
BoundSplat bind_place(thread BoundSplat& b, thread const Rows4& world, thread const float4& world_quat_wxyz)
{
    Rows4 param = world;
    float3 param_1 = b.mean;
    b.mean = transform_point(param, param_1);
    float4 param_2 = world_quat_wxyz;
    float4 param_3 = b.quat_wxyz;
    b.quat_wxyz = quat_multiply(param_2, param_3);
    Rows4 param_4 = world;
    Rows3 param_5 = linear_part(param_4);
    Rows3 param_6 = b.sh_rotation;
    b.sh_rotation = multiply(param_5, param_6);
    return b;
}

static inline __attribute__((always_inline))
void _bind_skin(thread const uint3& id, const device BindStatic& BindStatic_1, constant BindSkinConstants& constants, const device Pose& Pose_1, device Splats& Splats_1)
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
        transform = bind_skin_matrix(param, BindStatic_1, constants, Pose_1);
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
    float4 mean = Splats_1._data[row];
    float3 param_3 = mean.xyz;
    uint param_4 = row;
    float3 _1230 = bind_corrected(param_3, param_4, BindStatic_1, constants, Pose_1);
    uint param_5 = row;
    Rows4 param_6 = transform;
    Rows3 param_7 = rotation;
    float3 param_8 = _1230;
    float3 param_9 = bind_late(param_5, BindStatic_1, constants, Pose_1);
    float4 param_10 = Splats_1._data[constants.count + row];
    BoundSplat b = bind_by_matrix(param_6, param_7, param_8, param_9, param_10);
    if (constants.sh_direction == 1u)
    {
        b.sh_rotation = identity_rows();
    }
    BoundSplat param_11 = b;
    Rows4 param_12 = world;
    float4 param_13 = constants.world_quat_wxyz;
    BoundSplat _1264 = bind_place(param_11, param_12, param_13);
    b = _1264;
    Splats_1._data[row] = float4(b.mean, mean.w);
    Splats_1._data[constants.count + row] = b.quat_wxyz;
    Splats_1._data[(2u * constants.count) + row] = float4(b.sh_rotation.row0, ((device float*)&Splats_1._data[(2u * constants.count) + row])[3u]);
    Splats_1._data[(3u * constants.count) + row] = float4(b.sh_rotation.row1, ((device float*)&Splats_1._data[(3u * constants.count) + row])[3u]);
    Splats_1._data[(4u * constants.count) + row] = float4(b.sh_rotation.row2, ((device float*)&Splats_1._data[(4u * constants.count) + row])[3u]);
}

kernel void bind_skin(const device BindStatic& BindStatic_1 [[buffer(0)]], const device Pose& Pose_1 [[buffer(1)]], device Splats& Splats_1 [[buffer(2)]], constant BindSkinConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _bind_skin(param, BindStatic_1, constants, Pose_1, Splats_1);
}

)~"},
{"bind_triangles", R"~(// Generated from hlsl/bind_triangles.hlsl, entry bind_triangles, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct Rows3
{
    float3 row0;
    float3 row1;
    float3 row2;
};

struct TriangleShape
{
    Rows3 frame;
    float size;
    float3 across;
};

struct SurfaceStatic
{
    uint _data[1];
};

struct BindTrianglesConstants
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
};

struct Mesh
{
    float4 _data[1];
};

struct Triangles
{
    float4 _data[1];
};

static inline __attribute__((always_inline))
uint packed_element(thread const uint& word, thread const uint& bit, thread const uint& width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

static inline __attribute__((always_inline))
uint surface_code(thread const uint& section, thread const uint& index, thread const uint& width, const device SurfaceStatic& SurfaceStatic_1)
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

static inline __attribute__((always_inline))
uint corner(thread const uint& plane, thread const uint& row, const device SurfaceStatic& SurfaceStatic_1, constant BindTrianglesConstants& constants)
{
    uint param = constants.corners;
    uint param_1 = (plane * constants.triangles) + row;
    uint param_2 = constants.corners_width;
    return surface_code(param, param_1, param_2, SurfaceStatic_1);
}

static inline __attribute__((always_inline))
float surface_linear(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& scale, const device SurfaceStatic& SurfaceStatic_1)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = surface_code(param, param_1, param_2, SurfaceStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    return as_type<float>(SurfaceStatic_1._data[scale]) + (as_type<float>(SurfaceStatic_1._data[scale + 1u]) * float(code));
}

static inline __attribute__((always_inline))
float3 surface_linear3(thread const uint& section, thread const uint& index, thread const uint& stride, thread const uint& width, thread const uint& scale, const device SurfaceStatic& SurfaceStatic_1)
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
    return float3(surface_linear(param, param_1, param_2, param_3, SurfaceStatic_1), surface_linear(param_4, param_5, param_6, param_7, SurfaceStatic_1), surface_linear(param_8, param_9, param_10, param_11, SurfaceStatic_1));
}

static inline __attribute__((always_inline))
float3 canonical_position(thread const uint& vertex0, const device SurfaceStatic& SurfaceStatic_1, constant BindTrianglesConstants& constants)
{
    uint param = constants.canonical;
    uint param_1 = vertex0;
    uint param_2 = constants.vertices;
    uint param_3 = constants.canonical_width;
    uint param_4 = constants.canonical_scale;
    return surface_linear3(param, param_1, param_2, param_3, param_4, SurfaceStatic_1);
}

static inline __attribute__((always_inline))
float3 bind_unit(thread const float3& v)
{
    return v / float3(fast::max(length(v), 1.0000000031710768509710513471353e-30));
}

static inline __attribute__((always_inline))
Rows3 bind_columns(thread const float3& x, thread const float3& y, thread const float3& z)
{
    Rows3 m;
    m.row0 = float3(x.x, y.x, z.x);
    m.row1 = float3(x.y, y.y, z.y);
    m.row2 = float3(x.z, y.z, z.z);
    return m;
}

static inline __attribute__((always_inline))
TriangleShape triangle_by_edge(thread const float3& p0, thread const float3& p1, thread const float3& p2)
{
    float3 e = p1 - p0;
    float3 f = p2 - p0;
    TriangleShape t;
    t.across = cross(e, f);
    float3 param = e;
    float3 a0 = bind_unit(param);
    float3 param_1 = cross(a0, f);
    float3 a1 = bind_unit(param_1);
    float3 param_2 = cross(a1, a0);
    float3 a2 = -bind_unit(param_2);
    float3 param_3 = a0;
    float3 param_4 = a1;
    float3 param_5 = a2;
    t.frame = bind_columns(param_3, param_4, param_5);
    t.size = (length(e) + abs(dot(a2, f))) / 2.0;
    return t;
}

static inline __attribute__((always_inline))
float4 quat_from_matrix(thread const Rows3& m)
{
    float d0 = m.row0.x;
    float d1 = m.row1.y;
    float d2 = m.row2.z;
    float4 size = sqrt(fast::max(float4(((1.0 + d0) + d1) + d2, ((1.0 + d0) - d1) - d2, ((1.0 - d0) + d1) - d2, ((1.0 - d0) - d1) + d2), float4(0.0)));
    float a = m.row2.y - m.row1.z;
    float b = m.row0.z - m.row2.x;
    float c = m.row1.x - m.row0.y;
    float d = m.row1.x + m.row0.y;
    float e = m.row0.z + m.row2.x;
    float f = m.row2.y + m.row1.z;
    if (((size.x >= size.y) && (size.x >= size.z)) && (size.x >= size.w))
    {
        return float4(size.x * size.x, a, b, c) / float4(2.0 * size.x);
    }
    if ((size.y >= size.z) && (size.y >= size.w))
    {
        return float4(a, size.y * size.y, d, e) / float4(2.0 * size.y);
    }
    if (size.z >= size.w)
    {
        return float4(b, d, size.z * size.z, f) / float4(2.0 * size.z);
    }
    return float4(c, e, f, size.w * size.w) / float4(2.0 * size.w);
}

static inline __attribute__((always_inline))
TriangleShape triangle_by_area(thread const float3& p0, thread const float3& p1, thread const float3& p2)
{
    float3 e = p1 - p0;
    TriangleShape t;
    t.across = cross(e, p2 - p0);
    float3 param = t.across;
    float3 param_1 = cross(e, bind_unit(param));
    float3 x = bind_unit(param_1);
    float3 param_2 = cross(e, x);
    float3 param_3 = e;
    float3 param_4 = x;
    float3 param_5 = bind_unit(param_2);
    float3 param_6 = bind_unit(param_3);
    t.frame = bind_columns(param_4, param_5, param_6);
    t.size = length(t.across) / 2.0;
    return t;
}

static inline __attribute__((always_inline))
float3 rotate(thread const Rows3& m, thread const float3& v)
{
    return float3(dot(m.row0, v), dot(m.row1, v), dot(m.row2, v));
}

static inline __attribute__((always_inline))
Rows3 multiply_transposed(thread const Rows3& a, thread const Rows3& b)
{
    Rows3 param = b;
    float3 param_1 = a.row0;
    Rows3 r;
    r.row0 = rotate(param, param_1);
    Rows3 param_2 = b;
    float3 param_3 = a.row1;
    r.row1 = rotate(param_2, param_3);
    Rows3 param_4 = b;
    float3 param_5 = a.row2;
    r.row2 = rotate(param_4, param_5);
    return r;
}

static inline __attribute__((always_inline))
float4 triangle_turn(thread const Rows3& frame, thread const Rows3& canonical_frame, thread const uint& quaternion_sign)
{
    Rows3 param = frame;
    Rows3 param_1 = canonical_frame;
    Rows3 param_2 = multiply_transposed(param, param_1);
    float4 turn = quat_from_matrix(param_2);
    bool negative = (quaternion_sign == 1u) && (turn.x < 0.0);
    if (quaternion_sign == 2u)
    {
        negative = fast::max(turn.z, turn.w) > fast::max(turn.x, turn.y);
    }
    return select(turn, -turn, bool4(negative));
}

static inline __attribute__((always_inline))
void _bind_triangles(thread const uint3& id, const device SurfaceStatic& SurfaceStatic_1, constant BindTrianglesConstants& constants, const device Mesh& Mesh_1, device Triangles& Triangles_1)
{
    uint row = id.x;
    if (row >= constants.triangles)
    {
        return;
    }
    uint param = 0u;
    uint param_1 = row;
    uint v0 = corner(param, param_1, SurfaceStatic_1, constants);
    uint param_2 = 1u;
    uint param_3 = row;
    uint v1 = corner(param_2, param_3, SurfaceStatic_1, constants);
    uint param_4 = 2u;
    uint param_5 = row;
    uint v2 = corner(param_4, param_5, SurfaceStatic_1, constants);
    float3 p0 = Mesh_1._data[v0].xyz;
    float3 p1 = Mesh_1._data[v1].xyz;
    float3 p2 = Mesh_1._data[v2].xyz;
    uint param_6 = v0;
    float3 c0 = canonical_position(param_6, SurfaceStatic_1, constants);
    uint param_7 = v1;
    float3 c1 = canonical_position(param_7, SurfaceStatic_1, constants);
    uint param_8 = v2;
    float3 c2 = canonical_position(param_8, SurfaceStatic_1, constants);
    TriangleShape shape;
    TriangleShape rest;
    float4 turn;
    if (constants.rotation_rule == 2u)
    {
        float3 param_9 = p0;
        float3 param_10 = p1;
        float3 param_11 = p2;
        shape = triangle_by_edge(param_9, param_10, param_11);
        float3 param_12 = c0;
        float3 param_13 = c1;
        float3 param_14 = c2;
        rest = triangle_by_edge(param_12, param_13, param_14);
        Rows3 param_15 = shape.frame;
        turn = quat_from_matrix(param_15);
    }
    else
    {
        float3 param_16 = p0;
        float3 param_17 = p1;
        float3 param_18 = p2;
        shape = triangle_by_area(param_16, param_17, param_18);
        float3 param_19 = c0;
        float3 param_20 = c1;
        float3 param_21 = c2;
        rest = triangle_by_area(param_19, param_20, param_21);
        Rows3 param_22 = shape.frame;
        Rows3 param_23 = rest.frame;
        uint param_24 = constants.quaternion_sign;
        turn = triangle_turn(param_22, param_23, param_24);
    }
    Triangles_1._data[row] = float4(shape.across, shape.size);
    Triangles_1._data[constants.triangles + row] = turn;
    Triangles_1._data[(2u * constants.triangles) + row] = float4(rest.size, float(v0), float(v1), float(v2));
}

kernel void bind_triangles(const device SurfaceStatic& SurfaceStatic_1 [[buffer(0)]], const device Mesh& Mesh_1 [[buffer(1)]], device Triangles& Triangles_1 [[buffer(2)]], constant BindTrianglesConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _bind_triangles(param, SurfaceStatic_1, constants, Mesh_1, Triangles_1);
}

)~"},
{"bind_vertices", R"~(// Generated from hlsl/bind_vertices.hlsl, entry bind_vertices, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct Rows4
{
    float4 row0;
    float4 row1;
    float4 row2;
};

struct SurfaceStatic
{
    uint _data[1];
};

struct BindVerticesConstants
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
};

struct Pose
{
    float _data[1];
};

struct Triangles
{
    float4 _data[1];
};

struct Mesh
{
    float4 _data[1];
};

static inline __attribute__((always_inline))
uint packed_element(thread const uint& word, thread const uint& bit, thread const uint& width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

static inline __attribute__((always_inline))
uint surface_code(thread const uint& section, thread const uint& index, thread const uint& width, const device SurfaceStatic& SurfaceStatic_1)
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

static inline __attribute__((always_inline))
float3 vertex_normal(thread const float3& sum_across, thread const float& normal_floor)
{
    return sum_across / float3(fast::max(length(sum_across), normal_floor));
}

static inline __attribute__((always_inline))
Rows4 skin_none()
{
    Rows4 sum;
    sum.row0 = float4(0.0);
    sum.row1 = float4(0.0);
    sum.row2 = float4(0.0);
    return sum;
}

static inline __attribute__((always_inline))
float surface_weight(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& _step, const device SurfaceStatic& SurfaceStatic_1)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = surface_code(param, param_1, param_2, SurfaceStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    return as_type<float>(SurfaceStatic_1._data[_step]) * float(code);
}

static inline __attribute__((always_inline))
Rows4 vertex_joint(thread const uint& joint, constant BindVerticesConstants& constants, const device Pose& Pose_1)
{
    uint at = constants.joints + (12u * joint);
    Rows4 m;
    m.row0 = float4(Pose_1._data[at], Pose_1._data[at + 1u], Pose_1._data[at + 2u], Pose_1._data[at + 3u]);
    m.row1 = float4(Pose_1._data[at + 4u], Pose_1._data[at + 5u], Pose_1._data[at + 6u], Pose_1._data[at + 7u]);
    m.row2 = float4(Pose_1._data[at + 8u], Pose_1._data[at + 9u], Pose_1._data[at + 10u], Pose_1._data[at + 11u]);
    return m;
}

static inline __attribute__((always_inline))
Rows4 skin_add(thread Rows4& sum, thread const float& weight, thread const Rows4& joint)
{
    sum.row0 += (joint.row0 * weight);
    sum.row1 += (joint.row1 * weight);
    sum.row2 += (joint.row2 * weight);
    return sum;
}

static inline __attribute__((always_inline))
Rows4 vertex_skin_matrix(thread const uint& row, const device SurfaceStatic& SurfaceStatic_1, constant BindVerticesConstants& constants, const device Pose& Pose_1)
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
        float weight = surface_weight(param, param_1, param_2, param_3, SurfaceStatic_1);
        uint param_4 = constants.skin_column;
        uint param_5 = e;
        uint param_6 = constants.skin_column_width;
        uint param_7 = surface_code(param_4, param_5, param_6, SurfaceStatic_1);
        Rows4 param_8 = blended;
        float param_9 = weight;
        Rows4 param_10 = vertex_joint(param_7, constants, Pose_1);
        Rows4 _353 = skin_add(param_8, param_9, param_10);
        blended = _353;
    }
    return blended;
}

static inline __attribute__((always_inline))
float4 vertex_quat_mean(thread const float4& sum_turn, thread const float& sum_area)
{
    return sum_turn / float4(fast::max(sum_area, 1.0000000031710768509710513471353e-30));
}

static inline __attribute__((always_inline))
float4 vertex_quat(thread const float4& sum_turn, thread const float& quaternion_floor)
{
    return sum_turn / float4(fast::max(sqrt(dot(sum_turn, sum_turn)), quaternion_floor));
}

static inline __attribute__((always_inline))
void _bind_vertices(thread const uint3& id, const device SurfaceStatic& SurfaceStatic_1, constant BindVerticesConstants& constants, const device Pose& Pose_1, const device Triangles& Triangles_1, device Mesh& Mesh_1)
{
    uint row = id.x;
    if (row >= constants.vertices)
    {
        return;
    }
    float3 across = float3(0.0);
    float4 turn = float4(0.0);
    float area = 0.0;
    uint end = SurfaceStatic_1._data[(constants.vertex_triangle_ptr + row) + 1u];
    uint _386 = constants.vertex_triangle_ptr + row;
    for (uint e = SurfaceStatic_1._data[_386]; e < end; e++)
    {
        uint param = constants.vertex_triangle;
        uint param_1 = e;
        uint param_2 = constants.vertex_triangle_width;
        uint t = surface_code(param, param_1, param_2, SurfaceStatic_1);
        float canonical_size = ((device float*)&Triangles_1._data[(2u * constants.triangles) + t])[0u];
        across += Triangles_1._data[t].xyz;
        turn += (Triangles_1._data[constants.triangles + t] * canonical_size);
        area += canonical_size;
    }
    float3 param_3 = across;
    float param_4 = constants.normal_floor;
    Mesh_1._data[constants.vertices + row] = float4(vertex_normal(param_3, param_4), 0.0);
    if (constants.rotation_rule == 3u)
    {
        uint param_5 = row;
        Rows4 blended = vertex_skin_matrix(param_5, SurfaceStatic_1, constants, Pose_1);
        Mesh_1._data[(2u * constants.vertices) + row] = blended.row0;
        Mesh_1._data[(3u * constants.vertices) + row] = blended.row1;
        Mesh_1._data[(4u * constants.vertices) + row] = blended.row2;
    }
    else
    {
        if (constants.rotation_rule == 1u)
        {
            float4 param_6 = turn;
            float param_7 = area;
            Mesh_1._data[(2u * constants.vertices) + row] = vertex_quat_mean(param_6, param_7);
        }
        else
        {
            float4 param_8 = turn;
            float param_9 = constants.quaternion_floor;
            Mesh_1._data[(2u * constants.vertices) + row] = vertex_quat(param_8, param_9);
        }
    }
}

kernel void bind_vertices(const device SurfaceStatic& SurfaceStatic_1 [[buffer(0)]], const device Triangles& Triangles_1 [[buffer(1)]], const device Pose& Pose_1 [[buffer(2)]], device Mesh& Mesh_1 [[buffer(3)]], constant BindVerticesConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _bind_vertices(param, SurfaceStatic_1, constants, Pose_1, Triangles_1, Mesh_1);
}

)~"},
{"bind_surface", R"~(// Generated from hlsl/bind_surface.hlsl, entry bind_surface, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct Rows3
{
    float3 row0;
    float3 row1;
    float3 row2;
};

struct Rows4
{
    float4 row0;
    float4 row1;
    float4 row2;
};

struct BoundSplat
{
    float3 mean;
    float4 quat_wxyz;
    Rows3 sh_rotation;
};

struct TriangleShape
{
    Rows3 frame;
    float size;
    float3 across;
};

struct Foot
{
    uint3 vertex0;
    float3 weight;
};

struct EmbedStatic
{
    uint _data[1];
};

struct BindSurfaceConstants
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
    float4 world_row0;
    float4 world_row1;
    float4 world_row2;
    float4 world_quat_wxyz;
};

struct Mesh
{
    float4 _data[1];
};

struct Splats
{
    float4 _data[1];
};

static inline __attribute__((always_inline))
uint packed_element(thread const uint& word, thread const uint& bit, thread const uint& width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

static inline __attribute__((always_inline))
uint embed_code(thread const uint& section, thread const uint& index, thread const uint& width, const device EmbedStatic& EmbedStatic_1)
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

static inline __attribute__((always_inline))
float embed_linear(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& scale, const device EmbedStatic& EmbedStatic_1)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = embed_code(param, param_1, param_2, EmbedStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    return as_type<float>(EmbedStatic_1._data[scale]) + (as_type<float>(EmbedStatic_1._data[scale + 1u]) * float(code));
}

static inline __attribute__((always_inline))
float3 embed_linear3(thread const uint& section, thread const uint& index, thread const uint& stride, thread const uint& width, thread const uint& scale, const device EmbedStatic& EmbedStatic_1)
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
    return float3(embed_linear(param, param_1, param_2, param_3, EmbedStatic_1), embed_linear(param_4, param_5, param_6, param_7, EmbedStatic_1), embed_linear(param_8, param_9, param_10, param_11, EmbedStatic_1));
}

static inline __attribute__((always_inline))
float4 mesh_blend(thread const uint& plane, thread const Foot& foot, constant BindSurfaceConstants& constants, const device Mesh& Mesh_1)
{
    uint first = plane * constants.vertices;
    return ((Mesh_1._data[first + foot.vertex0.x] * foot.weight.x) + (Mesh_1._data[first + foot.vertex0.y] * foot.weight.y)) + (Mesh_1._data[first + foot.vertex0.z] * foot.weight.z);
}

static inline __attribute__((always_inline))
Rows3 polar(thread Rows3& m)
{
    for (int _step = 0; _step < 3; _step++)
    {
        float3 c0 = cross(m.row1, m.row2);
        float3 c1 = cross(m.row2, m.row0);
        float3 c2 = cross(m.row0, m.row1);
        float determinant = dot(m.row0, c0);
        m.row0 = (m.row0 + (c0 / float3(determinant))) * 0.5;
        m.row1 = (m.row1 + (c1 / float3(determinant))) * 0.5;
        m.row2 = (m.row2 + (c2 / float3(determinant))) * 0.5;
    }
    return m;
}

static inline __attribute__((always_inline))
float4 quat_from_matrix(thread const Rows3& m)
{
    float d0 = m.row0.x;
    float d1 = m.row1.y;
    float d2 = m.row2.z;
    float4 size = sqrt(fast::max(float4(((1.0 + d0) + d1) + d2, ((1.0 + d0) - d1) - d2, ((1.0 - d0) + d1) - d2, ((1.0 - d0) - d1) + d2), float4(0.0)));
    float a = m.row2.y - m.row1.z;
    float b = m.row0.z - m.row2.x;
    float c = m.row1.x - m.row0.y;
    float d = m.row1.x + m.row0.y;
    float e = m.row0.z + m.row2.x;
    float f = m.row2.y + m.row1.z;
    if (((size.x >= size.y) && (size.x >= size.z)) && (size.x >= size.w))
    {
        return float4(size.x * size.x, a, b, c) / float4(2.0 * size.x);
    }
    if ((size.y >= size.z) && (size.y >= size.w))
    {
        return float4(a, size.y * size.y, d, e) / float4(2.0 * size.y);
    }
    if (size.z >= size.w)
    {
        return float4(b, d, size.z * size.z, f) / float4(2.0 * size.z);
    }
    return float4(c, e, f, size.w * size.w) / float4(2.0 * size.w);
}

static inline __attribute__((always_inline))
float4 surface_turn(thread const uint& triangle_id, thread const Foot& foot, constant BindSurfaceConstants& constants, const device Mesh& Mesh_1, const device Mesh& Triangles)
{
    if (constants.rotation_rule == 2u)
    {
        return Triangles._data[constants.triangles + triangle_id];
    }
    if (constants.rotation_rule == 3u)
    {
        uint param = 2u;
        Foot param_1 = foot;
        Rows3 blended;
        blended.row0 = mesh_blend(param, param_1, constants, Mesh_1).xyz;
        uint param_2 = 3u;
        Foot param_3 = foot;
        blended.row1 = mesh_blend(param_2, param_3, constants, Mesh_1).xyz;
        uint param_4 = 4u;
        Foot param_5 = foot;
        blended.row2 = mesh_blend(param_4, param_5, constants, Mesh_1).xyz;
        Rows3 param_6 = blended;
        Rows3 _1127 = polar(param_6);
        Rows3 param_7 = _1127;
        return quat_from_matrix(param_7);
    }
    uint param_8 = 2u;
    Foot param_9 = foot;
    return mesh_blend(param_8, param_9, constants, Mesh_1);
}

static inline __attribute__((always_inline))
float3 bind_unit(thread const float3& v)
{
    return v / float3(fast::max(length(v), 1.0000000031710768509710513471353e-30));
}

static inline __attribute__((always_inline))
Rows3 bind_columns(thread const float3& x, thread const float3& y, thread const float3& z)
{
    Rows3 m;
    m.row0 = float3(x.x, y.x, z.x);
    m.row1 = float3(x.y, y.y, z.y);
    m.row2 = float3(x.z, y.z, z.z);
    return m;
}

static inline __attribute__((always_inline))
TriangleShape triangle_by_edge(thread const float3& p0, thread const float3& p1, thread const float3& p2)
{
    float3 e = p1 - p0;
    float3 f = p2 - p0;
    TriangleShape t;
    t.across = cross(e, f);
    float3 param = e;
    float3 a0 = bind_unit(param);
    float3 param_1 = cross(a0, f);
    float3 a1 = bind_unit(param_1);
    float3 param_2 = cross(a1, a0);
    float3 a2 = -bind_unit(param_2);
    float3 param_3 = a0;
    float3 param_4 = a1;
    float3 param_5 = a2;
    t.frame = bind_columns(param_3, param_4, param_5);
    t.size = (length(e) + abs(dot(a2, f))) / 2.0;
    return t;
}

static inline __attribute__((always_inline))
float3 rotate(thread const Rows3& m, thread const float3& v)
{
    return float3(dot(m.row0, v), dot(m.row1, v), dot(m.row2, v));
}

static inline __attribute__((always_inline))
float3 surface_position(thread const uint& row, thread const Foot& foot, thread const float& size, const device EmbedStatic& EmbedStatic_1, constant BindSurfaceConstants& constants, const device Mesh& Mesh_1)
{
    uint param = 0u;
    Foot param_1 = foot;
    float3 position = mesh_blend(param, param_1, constants, Mesh_1).xyz;
    if (constants.position_rule == 1u)
    {
        float3 param_2 = Mesh_1._data[foot.vertex0.x].xyz;
        float3 param_3 = Mesh_1._data[foot.vertex0.y].xyz;
        float3 param_4 = Mesh_1._data[foot.vertex0.z].xyz;
        TriangleShape shape = triangle_by_edge(param_2, param_3, param_4);
        uint param_5 = constants.local_offset;
        uint param_6 = row;
        uint param_7 = constants.count;
        uint param_8 = constants.local_offset_width;
        uint param_9 = constants.local_offset_scale;
        float3 offset = embed_linear3(param_5, param_6, param_7, param_8, param_9, EmbedStatic_1);
        Rows3 param_10 = shape.frame;
        float3 param_11 = offset;
        return position + (rotate(param_10, param_11) * size);
    }
    uint param_12 = 1u;
    Foot param_13 = foot;
    float3 normal = mesh_blend(param_12, param_13, constants, Mesh_1).xyz;
    if (constants.position_rule == 0u)
    {
        float3 param_14 = normal;
        normal = bind_unit(param_14);
    }
    uint param_15 = constants.displacement;
    uint param_16 = row;
    uint param_17 = constants.displacement_width;
    uint param_18 = constants.displacement_scale;
    return position + (normal * embed_linear(param_15, param_16, param_17, param_18, EmbedStatic_1));
}

static inline __attribute__((always_inline))
float4 bind_unit4(thread const float4& v)
{
    return v / float4(fast::max(sqrt(dot(v, v)), 1.0000000031710768509710513471353e-30));
}

static inline __attribute__((always_inline))
float4 quat_multiply(thread const float4& a, thread const float4& b)
{
    return float4((((a.x * b.x) - (a.y * b.y)) - (a.z * b.z)) - (a.w * b.w), (((a.x * b.y) + (a.y * b.x)) + (a.z * b.w)) - (a.w * b.z), (((a.x * b.z) - (a.y * b.w)) + (a.z * b.x)) + (a.w * b.y), (((a.x * b.w) + (a.y * b.z)) - (a.z * b.y)) + (a.w * b.x));
}

static inline __attribute__((always_inline))
Rows3 matrix_from_quat(thread const float4& q)
{
    float w = q.x;
    float x = q.y;
    float y = q.z;
    float z = q.w;
    Rows3 r;
    r.row0 = float3(1.0 - (2.0 * ((y * y) + (z * z))), 2.0 * ((x * y) - (w * z)), 2.0 * ((x * z) + (w * y)));
    r.row1 = float3(2.0 * ((x * y) + (w * z)), 1.0 - (2.0 * ((x * x) + (z * z))), 2.0 * ((y * z) - (w * x)));
    r.row2 = float3(2.0 * ((x * z) - (w * y)), 2.0 * ((y * z) + (w * x)), 1.0 - (2.0 * ((x * x) + (y * y))));
    return r;
}

static inline __attribute__((always_inline))
BoundSplat bind_by_turn(thread const float3& mean, thread const float4& turn, thread const float4& local_quat_wxyz)
{
    float4 param = turn;
    float4 unit_turn = bind_unit4(param);
    BoundSplat b;
    b.mean = mean;
    float4 param_1 = unit_turn;
    float4 param_2 = local_quat_wxyz;
    b.quat_wxyz = quat_multiply(param_1, param_2);
    float4 param_3 = unit_turn;
    b.sh_rotation = matrix_from_quat(param_3);
    return b;
}

static inline __attribute__((always_inline))
Rows3 identity_rows()
{
    Rows3 r;
    r.row0 = float3(1.0, 0.0, 0.0);
    r.row1 = float3(0.0, 1.0, 0.0);
    r.row2 = float3(0.0, 0.0, 1.0);
    return r;
}

static inline __attribute__((always_inline))
float3 transform_point(thread const Rows4& m, thread const float3& p)
{
    return float3((((m.row0.x * p.x) + (m.row0.y * p.y)) + (m.row0.z * p.z)) + m.row0.w, (((m.row1.x * p.x) + (m.row1.y * p.y)) + (m.row1.z * p.z)) + m.row1.w, (((m.row2.x * p.x) + (m.row2.y * p.y)) + (m.row2.z * p.z)) + m.row2.w);
}

static inline __attribute__((always_inline))
Rows3 linear_part(thread const Rows4& m)
{
    Rows3 r;
    r.row0 = m.row0.xyz;
    r.row1 = m.row1.xyz;
    r.row2 = m.row2.xyz;
    return r;
}

static inline __attribute__((always_inline))
float3 rotate_inverse(thread const Rows3& m, thread const float3& v)
{
    return ((m.row0 * v.x) + (m.row1 * v.y)) + (m.row2 * v.z);
}

static inline __attribute__(()~"
R"~(always_inline))
Rows3 multiply(thread const Rows3& a, thread const Rows3& b)
{
    Rows3 param = b;
    float3 param_1 = a.row0;
    Rows3 r;
    r.row0 = rotate_inverse(param, param_1);
    Rows3 param_2 = b;
    float3 param_3 = a.row1;
    r.row1 = rotate_inverse(param_2, param_3);
    Rows3 param_4 = b;
    float3 param_5 = a.row2;
    r.row2 = rotate_inverse(param_4, param_5);
    return r;
}

static inline __attribute__((always_inline))
BoundSplat bind_place(thread BoundSplat& b, thread const Rows4& world, thread const float4& world_quat_wxyz)
{
    Rows4 param = world;
    float3 param_1 = b.mean;
    b.mean = transform_point(param, param_1);
    float4 param_2 = world_quat_wxyz;
    float4 param_3 = b.quat_wxyz;
    b.quat_wxyz = quat_multiply(param_2, param_3);
    Rows4 param_4 = world;
    Rows3 param_5 = linear_part(param_4);
    Rows3 param_6 = b.sh_rotation;
    b.sh_rotation = multiply(param_5, param_6);
    return b;
}

static inline __attribute__((always_inline))
float3 scale_log_area(thread const float3& log_scale, thread const float& area, thread const float& canonical_area, thread const float& damping, thread const float& log_training_per_bundle)
{
    float ratio = (area + damping) / (canonical_area + damping);
    return ((log_scale + float3(log_training_per_bundle)) * ratio) - float3(log_training_per_bundle);
}

static inline __attribute__((always_inline))
float3 scale_linear(thread const float3& log_scale, thread const float& size, thread const float& canonical_size)
{
    return log_scale + float3(log(fast::max(size, 1.0000000031710768509710513471353e-30) / canonical_size));
}

static inline __attribute__((always_inline))
float3 surface_scale(thread const float3& log_scale, thread const float& size, thread const float& canonical, constant BindSurfaceConstants& constants)
{
    if (constants.scale_rule == 1u)
    {
        float3 param = log_scale;
        float param_1 = size;
        float param_2 = canonical;
        float param_3 = constants.area_damping;
        float param_4 = constants.log_training_per_bundle;
        return scale_log_area(param, param_1, param_2, param_3, param_4);
    }
    if (constants.scale_rule == 2u)
    {
        float3 param_5 = log_scale;
        float param_6 = size;
        float param_7 = canonical;
        return scale_linear(param_5, param_6, param_7);
    }
    return log_scale;
}

static inline __attribute__((always_inline))
void _bind_surface(thread const uint3& id, const device EmbedStatic& EmbedStatic_1, constant BindSurfaceConstants& constants, const device Mesh& Mesh_1, const device Mesh& Triangles, device Splats& Splats_1)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    uint param = constants.triangle_ids;
    uint param_1 = row;
    uint param_2 = constants.triangle_ids_width;
    uint t = embed_code(param, param_1, param_2, EmbedStatic_1);
    float4 rest = Triangles._data[(2u * constants.triangles) + t];
    Foot foot;
    foot.vertex0 = uint3(rest.yzw);
    uint param_3 = constants.barycentric;
    uint param_4 = row;
    uint param_5 = constants.count;
    uint param_6 = constants.barycentric_width;
    uint param_7 = constants.barycentric_scale;
    foot.weight = embed_linear3(param_3, param_4, param_5, param_6, param_7, EmbedStatic_1);
    uint param_8 = t;
    Foot param_9 = foot;
    float4 turn = surface_turn(param_8, param_9, constants, Mesh_1, Triangles);
    float size = ((device float*)&Triangles._data[t])[3u];
    uint param_10 = constants.local_quat;
    uint param_11 = row;
    uint param_12 = constants.local_quat_width;
    uint param_13 = constants.local_quat_scale;
    uint param_14 = constants.local_quat;
    uint param_15 = constants.count + row;
    uint param_16 = constants.count;
    uint param_17 = constants.local_quat_width;
    uint param_18 = constants.local_quat_scale + 2u;
    float4 local_quat_wxyz = float4(embed_linear(param_10, param_11, param_12, param_13, EmbedStatic_1), embed_linear3(param_14, param_15, param_16, param_17, param_18, EmbedStatic_1));
    uint param_19 = row;
    Foot param_20 = foot;
    float param_21 = size;
    float3 param_22 = surface_position(param_19, param_20, param_21, EmbedStatic_1, constants, Mesh_1);
    float4 param_23 = turn;
    float4 param_24 = local_quat_wxyz;
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
    float4 param_27 = constants.world_quat_wxyz;
    BoundSplat _1417 = bind_place(param_25, param_26, param_27);
    b = _1417;
    float3 log_scale = float3(((device float*)&Splats_1._data[(2u * constants.count) + row])[3u], ((device float*)&Splats_1._data[(3u * constants.count) + row])[3u], ((device float*)&Splats_1._data[(4u * constants.count) + row])[3u]);
    float3 param_28 = log_scale;
    float param_29 = size;
    float param_30 = rest.x;
    log_scale = surface_scale(param_28, param_29, param_30, constants);
    Splats_1._data[row] = float4(b.mean, ((device float*)&Splats_1._data[row])[3u]);
    Splats_1._data[constants.count + row] = b.quat_wxyz;
    Splats_1._data[(2u * constants.count) + row] = float4(b.sh_rotation.row0, log_scale.x);
    Splats_1._data[(3u * constants.count) + row] = float4(b.sh_rotation.row1, log_scale.y);
    Splats_1._data[(4u * constants.count) + row] = float4(b.sh_rotation.row2, log_scale.z);
}

kernel void bind_surface(const device EmbedStatic& EmbedStatic_1 [[buffer(0)]], const device Mesh& Mesh_1 [[buffer(1)]], const device Mesh& Triangles [[buffer(2)]], device Splats& Splats_1 [[buffer(3)]], constant BindSurfaceConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _bind_surface(param, EmbedStatic_1, constants, Mesh_1, Triangles, Splats_1);
}

)~"},
{"activate", R"~(// Generated from hlsl/activate.hlsl, entry activate, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct ActivateConstants
{
    uint count;
};

struct Splats
{
    float4 _data[1];
};

static inline __attribute__((always_inline))
float activate_opacity(thread const float& opacity_logit)
{
    float e = exp(-abs(opacity_logit));
    return ((opacity_logit >= 0.0) ? 1.0 : e) / (1.0 + e);
}

static inline __attribute__((always_inline))
float4 activate_quat(thread const float4& quat_wxyz)
{
    return quat_wxyz / float4(fast::max(sqrt(dot(quat_wxyz, quat_wxyz)), 9.9999999600419720025001879548654e-13));
}

static inline __attribute__((always_inline))
float3 activate_scale(thread const float3& log_scale)
{
    return exp(log_scale);
}

static inline __attribute__((always_inline))
void _activate(thread const uint3& id, constant ActivateConstants& constants, device Splats& Splats_1)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    float4 mean = Splats_1._data[row];
    float param = mean.w;
    Splats_1._data[row] = float4(mean.xyz, activate_opacity(param));
    float4 param_1 = Splats_1._data[constants.count + row];
    Splats_1._data[constants.count + row] = activate_quat(param_1);
    float4 row0 = Splats_1._data[(2u * constants.count) + row];
    float4 row1 = Splats_1._data[(3u * constants.count) + row];
    float4 row2 = Splats_1._data[(4u * constants.count) + row];
    float3 param_2 = float3(row0.w, row1.w, row2.w);
    float3 scale = activate_scale(param_2);
    Splats_1._data[(2u * constants.count) + row] = float4(row0.xyz, scale.x);
    Splats_1._data[(3u * constants.count) + row] = float4(row1.xyz, scale.y);
    Splats_1._data[(4u * constants.count) + row] = float4(row2.xyz, scale.z);
}

kernel void activate(device Splats& Splats_1 [[buffer(0)]], constant ActivateConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _activate(param, constants, Splats_1);
}

)~"},
{"project", R"~(// Generated from hlsl/project.hlsl, entry project, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct Rows3
{
    float3 row0;
    float3 row1;
    float3 row2;
};

struct Rows4
{
    float4 row0;
    float4 row1;
    float4 row2;
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
    float4 clip_x;
    float4 clip_y;
    float4 clip_z;
    float4 clip_w;
    float2 tan_half_fov;
    float2 size;
    float low_pass;
    float near_z;
};

struct SeenSplat
{
    float2 centre;
    float depth;
    float3 conic;
    float radius;
    float clip_depth;
};

struct ProjectConstants
{
    uint count;
    uint sh_degree;
    float near_z;
    float low_pass;
    float4 camera_row0;
    float4 camera_row1;
    float4 camera_row2;
    float4 clip_row0;
    float4 clip_row1;
    float4 clip_row2;
    float4 clip_row3;
    float4 eye;
    float2 tan_half_fov;
    float2 image_size;
};

struct Sh
{
    float _data[1];
};

struct Splats
{
    float4 _data[1];
};

struct Projected
{
    float4 _data[1];
};

static inline __attribute__((always_inline))
SplatCamera project_camera(constant ProjectConstants& constants)
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

static inline __attribute__((always_inline))
float3 transform_point(thread const Rows4& m, thread const float3& p)
{
    return float3((((m.row0.x * p.x) + (m.row0.y * p.y)) + (m.row0.z * p.z)) + m.row0.w, (((m.row1.x * p.x) + (m.row1.y * p.y)) + (m.row1.z * p.z)) + m.row1.w, (((m.row2.x * p.x) + (m.row2.y * p.y)) + (m.row2.z * p.z)) + m.row2.w);
}

static inline __attribute__((always_inline))
Rows3 matrix_from_quat(thread const float4& q)
{
    float w = q.x;
    float x = q.y;
    float y = q.z;
    float z = q.w;
    Rows3 r;
    r.row0 = float3(1.0 - (2.0 * ((y * y) + (z * z))), 2.0 * ((x * y) - (w * z)), 2.0 * ((x * z) + (w * y)));
    r.row1 = float3(2.0 * ((x * y) + (w * z)), 1.0 - (2.0 * ((x * x) + (z * z))), 2.0 * ((y * z) - (w * x)));
    r.row2 = float3(2.0 * ((x * z) - (w * y)), 2.0 * ((y * z) + (w * x)), 1.0 - (2.0 * ((x * x) + (y * y))));
    return r;
}

static inline __attribute__((always_inline))
Covariance covariance(thread const float3& scale, thread const float4& quat_wxyz)
{
    float4 param = quat_wxyz;
    Rows3 r = matrix_from_quat(param);
    float3 m0 = r.row0 * scale;
    float3 m1 = r.row1 * scale;
    float3 m2 = r.row2 * scale;
    Covariance s;
    s.xx = dot(m0, m0);
    s.xy = dot(m0, m1);
    s.xz = dot(m0, m2);
    s.yy = dot(m1, m1);
    s.yz = dot(m1, m2);
    s.zz = dot(m2, m2);
    return s;
}

static inline __attribute__((always_inline))
float project_form(thread const float3& a, thread const Covariance& s, thread const float3& b)
{
    float x = ((a.x * s.xx) + (a.y * s.xy)) + (a.z * s.xz);
    float y = ((a.x * s.xy) + (a.y * s.yy)) + (a.z * s.yz);
    float z = ((a.x * s.xz) + (a.y * s.yz)) + (a.z * s.zz);
    return ((x * b.x) + (y * b.y)) + (z * b.z);
}

static inline __attribute__((always_inline))
float3 projected_covariance(thread const float3& p, thread const Covariance& s, thread const SplatCamera& camera)
{
    float2 focal = camera.size / (camera.tan_half_fov * 2.0);
    float2 limit = camera.tan_half_fov * 1.2999999523162841796875;
    float2 xy = fast::min(limit, fast::max(-limit, p.xy / float2(p.z))) * p.z;
    float3 w0 = camera.camera_from_world.row0.xyz;
    float3 w1 = camera.camera_from_world.row1.xyz;
    float3 w2 = camera.camera_from_world.row2.xyz;
    float3 t0 = (w0 * (focal.x / p.z)) + (w2 * ((-(focal.x * xy.x)) / (p.z * p.z)));
    float3 t1 = (w1 * (focal.y / p.z)) + (w2 * ((-(focal.y * xy.y)) / (p.z * p.z)));
    float3 param = t0;
    Covariance param_1 = s;
    float3 param_2 = t0;
    float3 param_3 = t1;
    Covariance param_4 = s;
    float3 param_5 = t0;
    float3 param_6 = t1;
    Covariance param_7 = s;
    float3 param_8 = t1;
    return float3(project_form(param, param_1, param_2) + camera.low_pass, project_form(param_3, param_4, param_5), project_form(param_6, param_7, param_8) + camera.low_pass);
}

static inline __attribute__((always_inline))
bool is_finite(thread const float& x)
{
    return (as_type<uint>(x) & 2139095040u) != 2139095040u;
}

static inline __attribute__((always_inline))
bool touches_image(thread const float2& centre, thread const float& extent, thread const float2& size)
{
    float2 grid = ceil(size / float2(16.0));
    float2 low = fast::clamp((centre - float2(extent)) / float2(16.0), float2(-1000000.0), float2(1000000.0));
    float2 high = fast::clamp((((centre + float2(extent)) + float2(16.0)) - float2(1.0)) / float2(16.0), float2(-1000000.0), float2(1000000.0));
    low = fast::clamp(trunc(low), float2(0.0), grid);
    high = fast::clamp(trunc(high), float2(0.0), grid);
    return (high.x > low.x) && (high.y > low.y);
}

static inline __attribute__((always_inline))
SeenSplat project_splat(thread const float3& mean, thread const float3& scale, thread const float4& quat_wxyz, thread const SplatCamera& camera)
{
    Rows4 param = camera.camera_from_world;
    float3 param_1 = mean;
    float3 p = transform_point(param, param_1);
    float3 param_2 = scale;
    float4 param_3 = quat_wxyz;
    float3 param_4 = p;
    Covariance param_5 = covariance(param_2, param_3);
    SplatCamera param_6 = camera;
    float3 cov = projected_covariance(param_4, param_5, param_6);
    float det = (cov.x * cov.z) - (cov.y * cov.y);
    float mid = 0.5 * (cov.x + cov.z);
    float root = sqrt(fast::max(0.100000001490116119384765625, (mid * mid) - det));
    float radius = ceil(3.0 * sqrt(fast::max(mid + root, mid - root)));
    float4 at = float4(mean, 1.0);
    float reciprocal = 1.0 / (dot(camera.clip_w, at) + 1.0000000116860974230803549289703e-07);
    float2 ndc = float2(dot(camera.clip_x, at), dot(camera.clip_y, at)) * reciprocal;
    SeenSplat seen;
    seen.centre = (ndc * (camera.size * 0.5)) + ((camera.size * 0.5) - float2(0.5));
    seen.depth = p.z;
    seen.conic = float3(cov.z, -cov.y, cov.x) * (1.0 / det);
    float param_7 = det;
    float param_8 = radius;
    float param_9 = seen.centre.x + seen.centre.y;
    bool sound = ((is_finite(param_7) && (abs(det) > 0.0)) && is_finite(param_8)) && is_finite(param_9);
    float2 param_10 = seen.centre;
    float param_11 = radius;
    float2 param_12 = camera.size;
    bool drawn = (sound && (p.z > camera.near_z)) && touches_image(param_10, param_11, param_12);
    seen.radius = drawn ? radius : 0.0;
    seen.clip_depth = fast::clamp(dot(camera.clip_z, at) * reciprocal, 0.0, 1.0);
    return seen;
}

static inline __attribute__((always_inline))
float3 rotate_inverse(thread const Rows3& m, thread const float3& v)
{
    return ((m.row0 * v.x) + (m.row1 * v.y)) + (m.row2 * v.z);
}

static inline __attribute__((always_inline))
float3 sh_coefficient(thread const uint& k, thread const uint& row, constant ProjectConstants& constants, const device Sh& Sh_1)
{
    uint at = ((3u * k) * constants.count) + row;
    return float3(Sh_1._data[at], Sh_1._data[at + constants.count], Sh_1._data[at + (2u * constants.count)]);
}

static inline __attribute__((always_inline))
float3 sh_band0(thread const float3& k0)
{
    return k0 * 0.2820948064327239990234375;
}

static inline __attribute__((always_inline))
float3 sh_band1(thread const float3& d, thread const float3& k1, thread const float3& k2, thread const float3& k3)
{
    return ((k1 * ((-0.48860251903533935546875) * d.y)) + (k2 * (0.48860251903533935546875 * d.z))) + (k3 * ((-0.48860251903533935546875) * d.x));
}

static inline __attribute__((always_inline))
float3 sh_band2(thread const float3& d, thread const float3& k4, thread const float3& k5, thread const float3& k6, thread const float3& k7, thread const float3& k8)
{
    float xx = d.x * d.x;
    float yy = d.y * d.y;
    float zz = d.z * d.z;
    return ((((k4 * (1.09254848957061767578125 * (d.x * d.y))) + (k5 * ((-1.09254848957061767578125) * (d.y * d.z)))) + (k6 * (0.3153915703296661376953125 * (((2.0 * zz) - xx) - yy)))) + (k7 * ((-1.09254848957061767578125) * (d.x * d.z)))) + (k8 * (0.546274244785308837890625 * (xx - yy)));
}

static inline __attribute__((always_inline))
float3 sh_band3(thread const float3& d, thread const float3& k9, thread const float3& k10, thread const float3& k11, thread const float3& k12, thread const float3& k13, thread const float3& k14, thread const float3& k15)
{
    float xx = d.x * d.x;
    float yy = d.y * d.y;
    float zz = d.z * d.z;
    float3 _564 = ((((((k9 * (((-0.590043604373931884765625) * d.y) * ((3.0 * xx) - yy))) + (k10 * ((2.8906114101409912109375 * (d.x * d.y)) * d.z))) + (k11 * (((-0.4570457935333251953125) * d.y) * (((4.0 * zz) - xx) - yy)))) + (k12 * ((0.3731763362884521484375 * d.z) * (((2.0 * zz) - (3.0 * xx)) - (3.0 * yy))))) + (k13 * (((-0.4570457935333251953125) * d.x) * (((4.0 * zz) - xx) - yy)))) + (k14 * ((1.44530570507049560546875 * d.z) * (xx - yy)))) + (k15 * (((-0.590043604373931884765625) * d.x) * (xx - (3.0 * yy))));
    return _564;
}

static inline __attribute__((always_inline))
float3 splat_colour(thread const float3& d, thread const uint& row, constant ProjectConstants& constants, const device Sh& Sh_1)
{
    uint param = 0u;
    uint param_1 = row;
    float3 param_2 = sh_coefficient(param, param_1, constants, Sh_1);
    float3 colour = sh_band0(param_2);
    if (constants.sh_degree > 0u)
    {
        uint param_3 = 1u;
        uint param_4 = row;
        uint param_5 = 2u;
        uint param_6 = row;
        uint param_7 = 3u;
        uint param_8 = row;
        float3 param_9 = d;
        float3 param_10 = sh_coefficient(param_3, param_4, constants, Sh_1);
        float3 param_11 = sh_coefficient(param_5, param_6, constants, Sh_1);
        float3 param_12 = sh_coefficient(param_7, param_8, constants, Sh_1);
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
        float3 param_23 = d;
        float3 param_24 = sh_coefficient(param_13, param_14, constants, Sh_1);
        float3 param_25 = sh_coefficient(param_15, param_16, constants, Sh_1);
        float3 param_26 = sh_coefficient(param_17, param_18, constants, Sh_1);
        float3 param_27 = sh_coefficient(param_19, param_20, constants, Sh_1);
        float3 param_28 = sh_coefficient(param_21, param_22, constants, Sh_1);
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
        float3 param_43 = d;
        float3 param_44 = sh_coefficient(param_29, par)~"
R"~(am_30, constants, Sh_1);
        float3 param_45 = sh_coefficient(param_31, param_32, constants, Sh_1);
        float3 param_46 = sh_coefficient(param_33, param_34, constants, Sh_1);
        float3 param_47 = sh_coefficient(param_35, param_36, constants, Sh_1);
        float3 param_48 = sh_coefficient(param_37, param_38, constants, Sh_1);
        float3 param_49 = sh_coefficient(param_39, param_40, constants, Sh_1);
        float3 param_50 = sh_coefficient(param_41, param_42, constants, Sh_1);
        colour += sh_band3(param_43, param_44, param_45, param_46, param_47, param_48, param_49, param_50);
    }
    return fast::max(colour + float3(0.5), float3(0.0));
}

static inline __attribute__((always_inline))
void _project(thread const uint3& id, constant ProjectConstants& constants, const device Sh& Sh_1, const device Splats& Splats_1, device Projected& Projected_1)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    float4 mean = Splats_1._data[row];
    float4 row0 = Splats_1._data[(2u * constants.count) + row];
    float4 row1 = Splats_1._data[(3u * constants.count) + row];
    float4 row2 = Splats_1._data[(4u * constants.count) + row];
    float3 param = mean.xyz;
    float3 param_1 = float3(row0.w, row1.w, row2.w);
    float4 param_2 = Splats_1._data[constants.count + row];
    SplatCamera param_3 = project_camera(constants);
    SeenSplat seen = project_splat(param, param_1, param_2, param_3);
    if (!(seen.radius > 0.0))
    {
        Projected_1._data[row] = float4(0.0);
        Projected_1._data[constants.count + row] = float4(0.0);
        Projected_1._data[(2u * constants.count) + row] = float4(0.0);
        return;
    }
    Rows3 sh_rotation;
    sh_rotation.row0 = row0.xyz;
    sh_rotation.row1 = row1.xyz;
    sh_rotation.row2 = row2.xyz;
    float3 towards = mean.xyz - constants.eye.xyz;
    Rows3 param_4 = sh_rotation;
    float3 param_5 = towards / float3(length(towards));
    float3 d = rotate_inverse(param_4, param_5);
    Projected_1._data[row] = float4(seen.centre, seen.depth, mean.w);
    Projected_1._data[constants.count + row] = float4(seen.conic, seen.radius);
    float3 param_6 = d;
    uint param_7 = row;
    Projected_1._data[(2u * constants.count) + row] = float4(splat_colour(param_6, param_7, constants, Sh_1), seen.clip_depth);
}

kernel void project(const device Splats& Splats_1 [[buffer(0)]], const device Sh& Sh_1 [[buffer(1)]], device Projected& Projected_1 [[buffer(2)]], constant ProjectConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _project(param, constants, Sh_1, Splats_1, Projected_1);
}

)~"},
{"sort_keys", R"~(// Generated from hlsl/sort_keys.hlsl, entry sort_keys, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct SortKeysConstants
{
    uint count;
    uint first;
};

struct Pairs
{
    uint2 _data[1];
};

struct Projected
{
    float4 _data[1];
};

static inline __attribute__((always_inline))
uint sort_key(thread const float& depth, thread const float& radius)
{
    return (radius > 0.0) ? as_type<uint>(depth) : 4294967295u;
}

static inline __attribute__((always_inline))
void _sort_keys(thread const uint3& id, constant SortKeysConstants& constants, device Pairs& Pairs_1, const device Projected& Projected_1)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    float param = ((device float*)&Projected_1._data[row])[2u];
    float param_1 = ((device float*)&Projected_1._data[constants.count + row])[3u];
    Pairs_1._data[constants.first + row] = uint2(sort_key(param, param_1), constants.first + row);
}

kernel void sort_keys(const device Projected& Projected_1 [[buffer(0)]], device Pairs& Pairs_1 [[buffer(1)]], constant SortKeysConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _sort_keys(param, constants, Pairs_1, Projected_1);
}

)~"},
{"sort_count", R"~(// Generated from hlsl/sort_count.hlsl, entry sort_count, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"
#pragma clang diagnostic ignored "-Wunused-variable"

#include <metal_stdlib>
#include <simd/simd.h>
#include <metal_atomic>

using namespace metal;

struct SortCountConstants
{
    uint count;
    uint groups;
    uint shift;
};

struct Pairs
{
    uint2 _data[1];
};

struct Counts
{
    uint _data[1];
};

static inline __attribute__((always_inline))
uint sort_digit(thread const uint& key, thread const uint& shift)
{
    return (key >> shift) & 15u;
}

static inline __attribute__((always_inline))
void _sort_count(thread const uint3& group, thread const uint3& thread0, threadgroup uint (&occurrences)[16], constant SortCountConstants& constants, const device Pairs& Pairs_1, device Counts& Counts_1)
{
    uint lane = thread0.x;
    if (lane < 16u)
    {
        occurrences[lane] = 0u;
    }
    threadgroup_barrier(mem_flags::mem_threadgroup);
    for (uint i = 0u; i < 16u; i++)
    {
        uint at = ((group.x * 1024u) + (i * 64u)) + lane;
        if (at < constants.count)
        {
            uint param = ((device uint*)&Pairs_1._data[at])[0u];
            uint param_1 = constants.shift;
            uint _92 = atomic_fetch_add_explicit((threadgroup atomic_uint*)&occurrences[sort_digit(param, param_1)], 1u, memory_order_relaxed);
        }
    }
    threadgroup_barrier(mem_flags::mem_threadgroup);
    if (lane < 16u)
    {
        Counts_1._data[(lane * constants.groups) + group.x] = occurrences[lane];
    }
}

kernel void sort_count(const device Pairs& Pairs_1 [[buffer(0)]], device Counts& Counts_1 [[buffer(1)]], constant SortCountConstants& constants [[buffer(8)]], uint3 gl_WorkGroupID [[threadgroup_position_in_grid]], uint3 gl_LocalInvocationID [[thread_position_in_threadgroup]])
{
    threadgroup uint occurrences[16];
    uint3 group = gl_WorkGroupID;
    uint3 thread0 = gl_LocalInvocationID;
    uint3 param = group;
    uint3 param_1 = thread0;
    _sort_count(param, param_1, occurrences, constants, Pairs_1, Counts_1);
}

)~"},
{"sort_scan", R"~(// Generated from hlsl/sort_scan.hlsl, entry sort_scan, by `python -m avatar_shaders`; do not edit.
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

)~"},
{"sort_scatter", R"~(// Generated from hlsl/sort_scatter.hlsl, entry sort_scatter, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct SortScatterConstants
{
    uint count;
    uint groups;
    uint shift;
};

struct Pairs
{
    uint2 _data[1];
};

struct Counts
{
    uint _data[1];
};

struct PairsOut
{
    uint2 _data[1];
};

static inline __attribute__((always_inline))
uint sort_digit(thread const uint& key, thread const uint& shift)
{
    return (key >> shift) & 15u;
}

static inline __attribute__((always_inline))
void _sort_scatter(thread const uint3& group, thread const uint3& thread0, constant SortScatterConstants& constants, threadgroup uint (&places)[1024], const device Pairs& Pairs_1, const device Counts& Counts_1, device PairsOut& PairsOut_1)
{
    uint lane = thread0.x;
    uint begin = min(((group.x * 1024u) + (lane * 16u)), constants.count);
    uint end = min((begin + 16u), constants.count);
    for (uint d = 0u; d < 16u; d++)
    {
        places[(d * 64u) + lane] = 0u;
    }
    for (uint i = begin; i < end; i++)
    {
        uint param = ((device uint*)&Pairs_1._data[i])[0u];
        uint param_1 = constants.shift;
        uint _103 = (sort_digit(param, param_1) * 64u) + lane;
        places[_103]++;
    }
    threadgroup_barrier(mem_flags::mem_threadgroup);
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
    threadgroup_barrier(mem_flags::mem_threadgroup);
    for (uint j = begin; j < end; j++)
    {
        uint2 pair = Pairs_1._data[j];
        uint param_2 = pair.x;
        uint param_3 = constants.shift;
        uint at_1 = (sort_digit(param_2, param_3) * 64u) + lane;
        PairsOut_1._data[places[at_1]] = pair;
        places[at_1]++;
    }
}

kernel void sort_scatter(const device Pairs& Pairs_1 [[buffer(0)]], const device Counts& Counts_1 [[buffer(1)]], device PairsOut& PairsOut_1 [[buffer(2)]], constant SortScatterConstants& constants [[buffer(8)]], uint3 gl_WorkGroupID [[threadgroup_position_in_grid]], uint3 gl_LocalInvocationID [[thread_position_in_threadgroup]])
{
    threadgroup uint places[1024];
    uint3 group = gl_WorkGroupID;
    uint3 thread0 = gl_LocalInvocationID;
    uint3 param = group;
    uint3 param_1 = thread0;
    _sort_scatter(param, param_1, constants, places, Pairs_1, Counts_1, PairsOut_1);
}

)~"},
{"raster_gather", R"~(// Generated from hlsl/raster_gather.hlsl, entry raster_gather, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct RasterGatherConstants
{
    uint count;
    uint begin;
    uint piece_count;
    uint first;
    uint chunk_count;
    uint reverse;
};

struct Pairs
{
    uint2 _data[1];
};

struct Projected
{
    float4 _data[1];
};

struct Quads
{
    float4 _data[1];
};

static inline __attribute__((always_inline))
void _raster_gather(thread const uint3& id, constant RasterGatherConstants& constants, const device Pairs& Pairs_1, const device Projected& Projected_1, device Quads& Quads_1)
{
    uint instance = id.x;
    if (instance >= constants.piece_count)
    {
        return;
    }
    uint rank = constants.begin + instance;
    uint row = ((device uint*)&Pairs_1._data[(constants.reverse != 0u) ? ((constants.count - 1u) - rank) : rank])[1u] - constants.first;
    if (row >= constants.chunk_count)
    {
        return;
    }
    float4 place = Projected_1._data[row];
    float4 conic = Projected_1._data[constants.chunk_count + row];
    float4 rgb = Projected_1._data[(2u * constants.chunk_count) + row];
    Quads_1._data[3u * instance] = float4(place.xy, rgb.w, place.w);
    Quads_1._data[(3u * instance) + 1u] = float4(conic.xyz, 0.0);
    Quads_1._data[(3u * instance) + 2u] = float4(rgb.xyz, 0.0);
}

kernel void raster_gather(const device Projected& Projected_1 [[buffer(0)]], const device Pairs& Pairs_1 [[buffer(1)]], device Quads& Quads_1 [[buffer(2)]], constant RasterGatherConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _raster_gather(param, constants, Pairs_1, Projected_1, Quads_1);
}

)~"},
{"raster_vertex", R"~(// Generated from hlsl/raster.hlsl, entry raster_vertex, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct QuadFragment
{
    float4 position;
    float2 centre;
    float4 form;
    float3 rgb;
};

struct RasterConstants
{
    float2 image_size;
    float flip_y;
};

struct Quads
{
    float4 _data[1];
};

struct raster_vertex_out
{
    float2 _entryPointOutput_centre [[user(locn0)]];
    float4 _entryPointOutput_form [[user(locn1)]];
    float3 _entryPointOutput_rgb [[user(locn2)]];
    float4 gl_Position [[position]];
};

struct raster_vertex_in
{
    float4 quad0 [[attribute(0)]];
    float4 quad1 [[attribute(1)]];
    float4 quad2 [[attribute(2)]];
};

static inline __attribute__((always_inline))
float4 splat_form(thread const float3& conic, thread const float& opacity)
{
    float most = log2(opacity * 255.0);
    return float4((-0.721347510814666748046875) * conic.x, (-1.44269502162933349609375) * conic.y, (-0.721347510814666748046875) * conic.z, most);
}

static inline __attribute__((always_inline))
float2 splat_corner(thread float2& corner, thread const float2& centre, thread const float3& conic, thread const float& most, thread const float2& size)
{
    float reach = 1.38629436492919921875 * fast::max(most, 0.0);
    float det = ((conic.x * conic.z) - (conic.y * conic.y)) - (3.0000001061125658452510833740234e-07 * ((conic.x * conic.z) + (conic.y * conic.y)));
    if (!(det > 0.0))
    {
        return (((corner * 0.5) + float2(0.5)) * size) - float2(0.5);
    }
    float mid = 0.5 * (conic.x + conic.z);
    float half_gap = 0.5 * (conic.x - conic.z);
    float larger = mid + sqrt((half_gap * half_gap) + (conic.y * conic.y));
    float2 axis = select(float2(conic.y, larger - conic.x), float2(larger - conic.z, conic.y), bool2(half_gap >= 0.0));
    float axis_length = length(axis);
    axis = select(float2(1.0, 0.0), axis / float2(axis_length), bool2(axis_length > 0.0));
    float across = fast::min(sqrt(reach / larger), 1000000.0) + 0.125;
    float along = fast::min(sqrt((reach * larger) / det), 1000000.0) + 0.125;
    if (along < 8.0)
    {
        corner = select(float2(0.0, 2.0), float2(1.73205077648162841796875 * corner.x, -1.0), bool2(corner.y < 0.0));
    }
    return (centre + (axis * (corner.x * across))) + (float2(-axis.y, axis.x) * (corner.y * along));
}

static inline __attribute__((always_inline))
float4 clip_from_pixels(thread const float2& pixel, thread const float& clip_depth, thread const float2& size, thread const float& flip_y)
{
    float2 ndc = (((pixel * 2.0) + float2(1.0)) / size) - float2(1.0);
    return float4(ndc.x, (-flip_y) * ndc.y, clip_depth, 1.0);
}

static inline __attribute__((always_inline))
QuadFragment quad_vertex(thread const uint& vertex0, thread const float4& place, thread const float3& conic, thread const float3& rgb, constant RasterConstants& constants)
{
    QuadFragment q;
    q.centre = place.xy + float2(0.5);
    float3 param = conic;
    float param_1 = place.w;
    q.form = splat_form(param, param_1);
    q.rgb = rgb;
    q.position = float4(2.0, 2.0, 0.0, 1.0);
    if (q.form.w >= 0.0)
    {
        float2 corner = float2(float(((vertex0 & 1u) != 0u) ? 1 : (-1)), float(((vertex0 & 2u) != 0u) ? 1 : (-1)));
        float2 param_2 = corner;
        float2 param_3 = place.xy;
        float3 param_4 = conic;
        float param_5 = q.form.w;
        float2 param_6 = constants.image_size;
        float2 _320 = splat_corner(param_2, param_3, param_4, param_5, param_6);
        float2 pixel = _320;
        float2 param_7 = pixel;
        float param_8 = place.z;
        float2 param_9 = constants.image_size;
        float param_10 = constants.flip_y;
        q.position = clip_from_pixels(param_7, param_8, param_9, param_10);
    }
    return q;
}

static inline __attribute__((always_inline))
QuadFragment _raster_vertex(thread const float4& quad0, thread const float4& quad1, thread const float4& quad2, thread const uint& vertex0, constant RasterConstants& constants)
{
    uint param = vertex0;
    float4 param_1 = quad0;
    float3 param_2 = quad1.xyz;
    float3 param_3 = quad2.xyz;
    return quad_vertex(param, param_1, param_2, param_3, constants);
}

vertex raster_vertex_out raster_vertex(raster_vertex_in in [[stage_in]], constant RasterConstants& constants [[buffer(8)]], uint gl_VertexIndex [[vertex_id]])
{
    raster_vertex_out out = {};
    float4 quad0 = in.quad0;
    float4 quad1 = in.quad1;
    float4 quad2 = in.quad2;
    uint vertex0 = gl_VertexIndex;
    float4 param = quad0;
    float4 param_1 = quad1;
    float4 param_2 = quad2;
    uint param_3 = vertex0;
    QuadFragment flattenTemp = _raster_vertex(param, param_1, param_2, param_3, constants);
    out.gl_Position = flattenTemp.position;
    out._entryPointOutput_centre = flattenTemp.centre;
    out._entryPointOutput_form = flattenTemp.form;
    out._entryPointOutput_rgb = flattenTemp.rgb;
    return out;
}

)~"},
{"raster_pixel", R"~(// Generated from hlsl/raster.hlsl, entry raster_pixel, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct QuadFragment
{
    float4 position;
    float2 centre;
    float4 form;
    float3 rgb;
};

struct Quads
{
    float4 _data[1];
};

struct RasterConstants
{
    float2 image_size;
    float flip_y;
};

struct raster_pixel_out
{
    float4 _entryPointOutput [[color(0)]];
};

struct raster_pixel_in
{
    float2 q_centre [[user(locn0), flat]];
    float4 q_form [[user(locn1), flat]];
    float3 q_rgb [[user(locn2), flat]];
};

static inline __attribute__((always_inline))
float splat_level(thread const float2& offset, thread const float4& form)
{
    float power = (offset.x * ((form.x * offset.x) + (form.y * offset.y))) + ((form.z * offset.y) * offset.y);
    return (power > 0.0) ? (-1.0) : (power + form.w);
}

static inline __attribute__((always_inline))
float4 splat_fragment(thread const float3& rgb, thread const float& level0)
{
    float alpha = fast::min(0.9900000095367431640625, exp2(level0) * 0.0039215688593685626983642578125);
    return float4(rgb * alpha, alpha);
}

static inline __attribute__((always_inline))
float4 _raster_pixel(thread const QuadFragment& q)
{
    float2 param = q.centre - q.position.xy;
    float4 param_1 = q.form;
    float level0 = splat_level(param, param_1);
    if (level0 < 0.0)
    {
        discard_fragment();
    }
    float3 param_2 = q.rgb;
    float param_3 = level0;
    return splat_fragment(param_2, param_3);
}

fragment raster_pixel_out raster_pixel(raster_pixel_in in [[stage_in]], float4 gl_FragCoord [[position]])
{
    raster_pixel_out out = {};
    QuadFragment q;
    q.position = gl_FragCoord;
    q.centre = in.q_centre;
    q.form = in.q_form;
    q.rgb = in.q_rgb;
    QuadFragment param = q;
    float4 _138 = _raster_pixel(param);
    out._entryPointOutput = _138;
    return out;
}

)~"},
{"composite_vertex", R"~(// Generated from hlsl/composite.hlsl, entry composite_vertex, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct CompositeConstants
{
    float4 background;
    float linear_target;
    float flip_rows;
    float2 image_size;
};

struct composite_vertex_out
{
    float4 gl_Position [[position]];
};

static inline __attribute__((always_inline))
float4 _composite_vertex(thread const uint& vertex0)
{
    return float4(float((vertex0 == 1u) ? 3 : (-1)), float((vertex0 == 2u) ? 3 : (-1)), 0.0, 1.0);
}

vertex composite_vertex_out composite_vertex(uint gl_VertexIndex [[vertex_id]])
{
    composite_vertex_out out = {};
    uint vertex0 = gl_VertexIndex;
    uint param = vertex0;
    out.gl_Position = _composite_vertex(param);
    return out;
}

)~"},
{"composite_pixel", R"~(// Generated from hlsl/composite.hlsl, entry composite_pixel, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct CompositeConstants
{
    float4 background;
    float linear_target;
    float flip_rows;
    float2 image_size;
};

struct composite_pixel_out
{
    float4 _entryPointOutput [[color(0)]];
};

static inline __attribute__((always_inline))
float3 linear_from_display(thread const float3& srgb)
{
    float3 low = srgb / float3(12.9200000762939453125);
    float3 high = pow(fast::max((srgb + float3(0.054999999701976776123046875)) / float3(1.05499994754791259765625), float3(0.0)), float3(2.400000095367431640625));
    return float3((srgb.x <= 0.040449999272823333740234375) ? low.x : high.x, (srgb.y <= 0.040449999272823333740234375) ? low.y : high.y, (srgb.z <= 0.040449999272823333740234375) ? low.z : high.z);
}

static inline __attribute__((always_inline))
float4 _composite_pixel(thread const float4& position, constant CompositeConstants& constants, texture2d<float> Accumulated)
{
    float y = (constants.flip_rows != 0.0) ? (constants.image_size.y - position.y) : position.y;
    float4 colour = Accumulated.read(uint2(int3(int(position.x), int(y), 0).xy), int3(int(position.x), int(y), 0).z);
    float left = 1.0 - colour.w;
    float alpha = colour.w + (left * constants.background.w);
    float3 display = colour.xyz + (constants.background.xyz * (left * constants.background.w));
    if (constants.linear_target != 0.0)
    {
        float3 straight = select(display, display / float3(alpha), bool3(alpha > 0.0));
        float3 param = straight;
        display = linear_from_display(param) * alpha;
    }
    return float4(display, alpha);
}

fragment composite_pixel_out composite_pixel(constant CompositeConstants& constants [[buffer(8)]], texture2d<float> Accumulated [[texture(0)]], float4 gl_FragCoord [[position]])
{
    composite_pixel_out out = {};
    float4 position = gl_FragCoord;
    float4 param = position;
    out._entryPointOutput = _composite_pixel(param, constants, Accumulated);
    return out;
}

)~"},
};
const uint32_t msl_text_count = 18;

}  // namespace avatar
