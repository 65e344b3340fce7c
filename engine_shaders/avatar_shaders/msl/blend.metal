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
float3 blend_base3(thread const uint& plane, thread const uint& row, const device BlendStatic& BlendStatic_1, constant BlendConstants& constants)
{
    uint param = plane;
    uint param_1 = row;
    uint param_2 = plane + 1u;
    uint param_3 = row;
    uint param_4 = plane + 2u;
    uint param_5 = row;
    return float3(blend_base(param, param_1, BlendStatic_1, constants), blend_base(param_2, param_3, BlendStatic_1, constants), blend_base(param_4, param_5, BlendStatic_1, constants));
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
BlendGeometry blended_geometry(thread const uint& row, const device BlendStatic& BlendStatic_1, constant BlendConstants& constants, const device Pose& Pose_1)
{
    uint param = 0u;
    uint param_1 = row;
    BlendGeometry g;
    g.mean = blend_base3(param, param_1, BlendStatic_1, constants);
    uint param_2 = 6u;
    uint param_3 = row;
    uint param_4 = 7u;
    uint param_5 = row;
    g.quat_wxyz = float4(blend_base(param_2, param_3, BlendStatic_1, constants), blend_base3(param_4, param_5, BlendStatic_1, constants));
    uint end = BlendStatic_1._data[(constants.geometry_ptr + row) + 1u];
    uint _224 = constants.geometry_ptr + row;
    for (uint e = BlendStatic_1._data[_224]; e < end; e++)
    {
        uint at = constants.geometry_entry + (8u * e);
        float weight = Pose_1._data[constants.weights + BlendStatic_1._data[at]];
        if (weight != 0.0)
        {
            uint param_6 = at + 1u;
            uint param_7 = at + 4u;
            uint param_8 = at + 5u;
            BlendGeometry param_9 = g;
            float param_10 = weight;
            float3 param_11 = blend_value3(param_6, BlendStatic_1);
            float4 param_12 = float4(blend_value(param_7, BlendStatic_1), blend_value3(param_8, BlendStatic_1));
            BlendGeometry _288 = blend_geometry(param_9, param_10, param_11, param_12);
            g = _288;
        }
    }
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
BlendAppearance blended_appearance(thread const uint& row, const device BlendStatic& BlendStatic_1, constant BlendConstants& constants, const device Pose& Pose_1)
{
    uint param = 3u;
    uint param_1 = row;
    BlendAppearance a;
    a.log_scale = blend_base3(param, param_1, BlendStatic_1, constants);
    uint param_2 = 10u;
    uint param_3 = row;
    a.opacity_logit = blend_base(param_2, param_3, BlendStatic_1, constants);
    uint end = BlendStatic_1._data[(constants.appearance_ptr + row) + 1u];
    uint _320 = constants.appearance_ptr + row;
    for (uint e = BlendStatic_1._data[_320]; e < end; e++)
    {
        uint at = constants.appearance_entry + ((5u + (3u * constants.sh_terms)) * e);
        float weight = Pose_1._data[constants.weights + BlendStatic_1._data[at]];
        if (weight != 0.0)
        {
            uint param_4 = at + 1u;
            uint param_5 = at + 4u;
            BlendAppearance param_6 = a;
            float param_7 = weight;
            float3 param_8 = blend_value3(param_4, BlendStatic_1);
            float param_9 = blend_value(param_5, BlendStatic_1);
            BlendAppearance _369 = blend_appearance(param_6, param_7, param_8, param_9);
            a = _369;
        }
    }
    return a;
}

static inline __attribute__((always_inline))
float3 blend_sh(thread const float3& coefficient, thread const float& weight, thread const float3& delta)
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
    uint stride = 5u + (3u * constants.sh_terms);
    uint t0 = 3u * k;
    uint t1 = 3u * min((k + 1u), last);
    uint t2 = 3u * min((k + 2u), last);
    uint t3 = 3u * min((k + 3u), last);
    uint param = 11u + t0;
    uint param_1 = row;
    float3 c0 = blend_base3(param, param_1, BlendStatic_1, constants);
    uint param_2 = 11u + t1;
    uint param_3 = row;
    float3 c1 = blend_base3(param_2, param_3, BlendStatic_1, constants);
    uint param_4 = 11u + t2;
    uint param_5 = row;
    float3 c2 = blend_base3(param_4, param_5, BlendStatic_1, constants);
    uint param_6 = 11u + t3;
    uint param_7 = row;
    float3 c3 = blend_base3(param_6, param_7, BlendStatic_1, constants);
    uint end = BlendStatic_1._data[(constants.appearance_ptr + row) + 1u];
    uint _483 = constants.appearance_ptr + row;
    for (uint e = BlendStatic_1._data[_483]; e < end; e++)
    {
        uint at = constants.appearance_entry + (stride * e);
        float weight = Pose_1._data[constants.weights + BlendStatic_1._data[at]];
        if (weight != 0.0)
        {
            uint param_8 = (at + 5u) + t0;
            float3 param_9 = c0;
            float param_10 = weight;
            float3 param_11 = blend_value3(param_8, BlendStatic_1);
            c0 = blend_sh(param_9, param_10, param_11);
            uint param_12 = (at + 5u) + t1;
            float3 param_13 = c1;
            float param_14 = weight;
            float3 param_15 = blend_value3(param_12, BlendStatic_1);
            c1 = blend_sh(param_13, param_14, param_15);
            uint param_16 = (at + 5u) + t2;
            float3 param_17 = c2;
            float param_18 = weight;
            float3 param_19 = blend_value3(param_16, BlendStatic_1);
            c2 = blend_sh(param_17, param_18, param_19);
            uint param_20 = (at + 5u) + t3;
            float3 param_21 = c3;
            float param_22 = weight;
            float3 param_23 = blend_value3(param_20, BlendStatic_1);
            c3 = blend_sh(param_21, param_22, param_23);
        }
    }
    uint param_24 = k;
    uint param_25 = row;
    float3 param_26 = c0;
    blend_store_sh(param_24, param_25, param_26, constants, Sh_1);
    uint param_27 = k + 1u;
    uint param_28 = row;
    float3 param_29 = c1;
    blend_store_sh(param_27, param_28, param_29, constants, Sh_1);
    uint param_30 = k + 2u;
    uint param_31 = row;
    float3 param_32 = c2;
    blend_store_sh(param_30, param_31, param_32, constants, Sh_1);
    uint param_33 = k + 3u;
    uint param_34 = row;
    float3 param_35 = c3;
    blend_store_sh(param_33, param_34, param_35, constants, Sh_1);
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

