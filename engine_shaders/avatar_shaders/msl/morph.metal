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

struct Pose
{
    float _data[1];
};

struct MorphConstants
{
    uint first;
    uint count;
    uint vertices;
    uint template_plane;
    uint morph_ptr;
    uint morph_entry;
    uint corrective_ptr;
    uint corrective_entry;
    uint weights;
    uint features;
};

struct Mesh
{
    float4 _data[1];
};

static inline __attribute__((always_inline))
float3 morph_add(thread const float3& position, thread const float& weight, thread const float3& delta)
{
    return position + (delta * weight);
}

static inline __attribute__((always_inline))
float3 morph_sum(thread float3& position, thread const uint& row, thread const uint& ptr, thread const uint& entry, thread const uint& pose, const device MorphStatic& MorphStatic_1, const device Pose& Pose_1)
{
    uint end = MorphStatic_1._data[(ptr + row) + 1u];
    uint _57 = ptr + row;
    for (uint e = MorphStatic_1._data[_57]; e < end; e++)
    {
        uint at = entry + (4u * e);
        float weight = Pose_1._data[pose + MorphStatic_1._data[at]];
        if (weight != 0.0)
        {
            float3 delta = float3(as_type<float>(MorphStatic_1._data[at + 1u]), as_type<float>(MorphStatic_1._data[at + 2u]), as_type<float>(MorphStatic_1._data[at + 3u]));
            float3 param = position;
            float param_1 = weight;
            float3 param_2 = delta;
            position = morph_add(param, param_1, param_2);
        }
    }
    return position;
}

static inline __attribute__((always_inline))
void _morph(thread const uint3& id, const device MorphStatic& MorphStatic_1, const device Pose& Pose_1, constant MorphConstants& constants, device Mesh& Mesh_1)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    uint at = constants.template_plane + row;
    float3 position = float3(as_type<float>(MorphStatic_1._data[at]), as_type<float>(MorphStatic_1._data[at + constants.count]), as_type<float>(MorphStatic_1._data[at + (2u * constants.count)]));
    float3 param = position;
    uint param_1 = row;
    uint param_2 = constants.morph_ptr;
    uint param_3 = constants.morph_entry;
    uint param_4 = constants.weights;
    float3 _182 = morph_sum(param, param_1, param_2, param_3, param_4, MorphStatic_1, Pose_1);
    position = _182;
    float3 param_5 = position;
    uint param_6 = row;
    uint param_7 = constants.corrective_ptr;
    uint param_8 = constants.corrective_entry;
    uint param_9 = constants.features;
    float3 _199 = morph_sum(param_5, param_6, param_7, param_8, param_9, MorphStatic_1, Pose_1);
    position = _199;
    Mesh_1._data[constants.first + row] = float4(position, 1.0);
}

kernel void morph(const device MorphStatic& MorphStatic_1 [[buffer(0)]], const device Pose& Pose_1 [[buffer(1)]], device Mesh& Mesh_1 [[buffer(2)]], constant MorphConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _morph(param, MorphStatic_1, Pose_1, constants, Mesh_1);
}

