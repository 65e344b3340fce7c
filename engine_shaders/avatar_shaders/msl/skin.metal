// Generated from hlsl/skin.hlsl, entry skin, by `python -m avatar_shaders`; do not edit.
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

struct SkinConstants
{
    uint first;
    uint count;
    uint late_ptr;
    uint late_entry;
    uint skin_ptr;
    uint skin_entry;
    uint late;
    uint joints;
};

struct Pose
{
    float _data[1];
};

struct SkinStatic
{
    uint _data[1];
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
float3 late_add(thread const float3& posed, thread const float& weight, thread const float3& delta)
{
    return posed + (delta * weight);
}

static inline __attribute__((always_inline))
void _skin(thread const uint3& id, constant SkinConstants& constants, const device Pose& Pose_1, const device SkinStatic& SkinStatic_1, device Mesh& Mesh_1)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    Rows4 blended = skin_none();
    uint end = SkinStatic_1._data[(constants.skin_ptr + row) + 1u];
    uint _272 = constants.skin_ptr + row;
    for (uint e = SkinStatic_1._data[_272]; e < end; e++)
    {
        uint at = constants.skin_entry + (2u * e);
        uint param = SkinStatic_1._data[at];
        Rows4 param_1 = blended;
        float param_2 = as_type<float>(SkinStatic_1._data[at + 1u]);
        Rows4 param_3 = skin_joint(param, constants, Pose_1);
        Rows4 _304 = skin_add(param_1, param_2, param_3);
        blended = _304;
    }
    Rows4 param_4 = blended;
    float3 param_5 = Mesh_1._data[constants.first + row].xyz;
    float3 posed = transform_point(param_4, param_5);
    uint late_end = SkinStatic_1._data[(constants.late_ptr + row) + 1u];
    uint _336 = constants.late_ptr + row;
    for (uint l = SkinStatic_1._data[_336]; l < late_end; l++)
    {
        uint at_1 = constants.late_entry + (4u * l);
        float3 delta = float3(as_type<float>(SkinStatic_1._data[at_1 + 1u]), as_type<float>(SkinStatic_1._data[at_1 + 2u]), as_type<float>(SkinStatic_1._data[at_1 + 3u]));
        float3 param_6 = posed;
        float param_7 = Pose_1._data[constants.late + SkinStatic_1._data[at_1]];
        float3 param_8 = delta;
        posed = late_add(param_6, param_7, param_8);
    }
    Mesh_1._data[constants.first + row] = float4(posed, 1.0);
}

kernel void skin(const device SkinStatic& SkinStatic_1 [[buffer(0)]], const device Pose& Pose_1 [[buffer(1)]], device Mesh& Mesh_1 [[buffer(2)]], constant SkinConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _skin(param, constants, Pose_1, SkinStatic_1, Mesh_1);
}

