// Generated from hlsl/morph.hlsl, entry morph, by `python -m avatar_shaders`; do not edit.
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

