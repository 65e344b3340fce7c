// Generated from hlsl/activate.hlsl, entry activate, by `python -m avatar_shaders`; do not edit.
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

