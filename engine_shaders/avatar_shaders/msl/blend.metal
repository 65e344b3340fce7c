// Generated from hlsl/blend.hlsl, entry blend, by `python -m avatar_shaders`; do not edit.
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
    uint base_plane;
    uint geometry_ptr;
    uint geometry_entry;
    uint appearance_ptr;
    uint appearance_entry;
    uint weights;
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
float blend_value(thread const uint& at, const device BlendStatic& BlendStatic_1)
{
    return as_type<float>(BlendStatic_1._data[at]);
}

static inline __attribute__((always_inline))
float blend_base(thread const uint& plane, thread const uint& row, const device BlendStatic& BlendStatic_1, constant BlendConstants& constants)
{
    uint param = (constants.base_plane + (plane * constants.count)) + row;
    return blend_value(param, BlendStatic_1);
}

static inline __attribute__((always_inline))
float3 blend_value3(thread const uint& at, const device BlendStatic& BlendStatic_1)
{
    uint param = at;
    uint param_1 = at + 1u;
    uint param_2 = at + 2u;
    return float3(blend_value(param, BlendStatic_1), blend_value(param_1, BlendStatic_1), blend_value(param_2, BlendStatic_1));
}

static inline __attribute__((always_inline))
BlendGeometry blend_geometry(thread BlendGeometry& g, thread const float& weight, thread const float3& mean, thread const float4& quat_wxyz)
{
    g.mean += (mean * weight);
    g.quat_wxyz += (quat_wxyz * weight);
    return g;
}

static inline __attribute__((always_inline))
BlendAppearance blend_appearance(thread BlendAppearance& a, thread const float& weight, thread const float3& log_scale, thread const float& opacity_logit)
{
    a.log_scale += (log_scale * weight);
    a.opacity_logit += (weight * opacity_logit);
    return a;
}

static inline __attribute__((always_inline))
float blend_sh(thread const float& coefficient, thread const float& weight, thread const float& delta)
{
    return coefficient + (weight * delta);
}

static inline __attribute__((always_inline))
void _blend(thread const uint3& id, const device BlendStatic& BlendStatic_1, constant BlendConstants& constants, const device Pose& Pose_1, device Sh& Sh_1, device Splats& Splats_1)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    uint param = 0u;
    uint param_1 = row;
    uint param_2 = 1u;
    uint param_3 = row;
    uint param_4 = 2u;
    uint param_5 = row;
    BlendGeometry g;
    g.mean = float3(blend_base(param, param_1, BlendStatic_1, constants), blend_base(param_2, param_3, BlendStatic_1, constants), blend_base(param_4, param_5, BlendStatic_1, constants));
    uint param_6 = 6u;
    uint param_7 = row;
    uint param_8 = 7u;
    uint param_9 = row;
    uint param_10 = 8u;
    uint param_11 = row;
    uint param_12 = 9u;
    uint param_13 = row;
    g.quat_wxyz = float4(blend_base(param_6, param_7, BlendStatic_1, constants), blend_base(param_8, param_9, BlendStatic_1, constants), blend_base(param_10, param_11, BlendStatic_1, constants), blend_base(param_12, param_13, BlendStatic_1, constants));
    uint end = BlendStatic_1._data[(constants.geometry_ptr + row) + 1u];
    uint _207 = constants.geometry_ptr + row;
    for (uint e = BlendStatic_1._data[_207]; e < end; e++)
    {
        uint at = constants.geometry_entry + (8u * e);
        float weight = Pose_1._data[constants.weights + BlendStatic_1._data[at]];
        if (weight != 0.0)
        {
            uint param_14 = at + 1u;
            uint param_15 = at + 4u;
            uint param_16 = at + 5u;
            BlendGeometry param_17 = g;
            float param_18 = weight;
            float3 param_19 = blend_value3(param_14, BlendStatic_1);
            float4 param_20 = float4(blend_value(param_15, BlendStatic_1), blend_value3(param_16, BlendStatic_1));
            BlendGeometry _269 = blend_geometry(param_17, param_18, param_19, param_20);
            g = _269;
        }
    }
    uint param_21 = 3u;
    uint param_22 = row;
    uint param_23 = 4u;
    uint param_24 = row;
    uint param_25 = 5u;
    uint param_26 = row;
    BlendAppearance a;
    a.log_scale = float3(blend_base(param_21, param_22, BlendStatic_1, constants), blend_base(param_23, param_24, BlendStatic_1, constants), blend_base(param_25, param_26, BlendStatic_1, constants));
    uint param_27 = 10u;
    uint param_28 = row;
    a.opacity_logit = blend_base(param_27, param_28, BlendStatic_1, constants);
    uint terms = 3u * constants.sh_terms;
    for (uint s = 0u; s < terms; s++)
    {
        uint param_29 = 11u + s;
        uint param_30 = row;
        Sh_1._data[(s * constants.count) + row] = blend_base(param_29, param_30, BlendStatic_1, constants);
    }
    uint appearance_end = BlendStatic_1._data[(constants.appearance_ptr + row) + 1u];
    uint _340 = constants.appearance_ptr + row;
    for (uint i = BlendStatic_1._data[_340]; i < appearance_end; i++)
    {
        uint at_1 = constants.appearance_entry + ((5u + terms) * i);
        float weight_1 = Pose_1._data[constants.weights + BlendStatic_1._data[at_1]];
        if (weight_1 != 0.0)
        {
            uint param_31 = at_1 + 1u;
            uint param_32 = at_1 + 4u;
            BlendAppearance param_33 = a;
            float param_34 = weight_1;
            float3 param_35 = blend_value3(param_31, BlendStatic_1);
            float param_36 = blend_value(param_32, BlendStatic_1);
            BlendAppearance _387 = blend_appearance(param_33, param_34, param_35, param_36);
            a = _387;
            for (uint t = 0u; t < terms; t++)
            {
                uint plane = (t * constants.count) + row;
                uint param_37 = (at_1 + 5u) + t;
                float param_38 = Sh_1._data[plane];
                float param_39 = weight_1;
                float param_40 = blend_value(param_37, BlendStatic_1);
                Sh_1._data[plane] = blend_sh(param_38, param_39, param_40);
            }
        }
    }
    Splats_1._data[row] = float4(g.mean, a.opacity_logit);
    Splats_1._data[constants.count + row] = g.quat_wxyz;
    Splats_1._data[(2u * constants.count) + row] = float4(1.0, 0.0, 0.0, a.log_scale.x);
    Splats_1._data[(3u * constants.count) + row] = float4(0.0, 1.0, 0.0, a.log_scale.y);
    Splats_1._data[(4u * constants.count) + row] = float4(0.0, 0.0, 1.0, a.log_scale.z);
}

kernel void blend(const device BlendStatic& BlendStatic_1 [[buffer(0)]], const device Pose& Pose_1 [[buffer(1)]], device Splats& Splats_1 [[buffer(2)]], device Sh& Sh_1 [[buffer(3)]], constant BlendConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _blend(param, BlendStatic_1, constants, Pose_1, Sh_1, Splats_1);
}

