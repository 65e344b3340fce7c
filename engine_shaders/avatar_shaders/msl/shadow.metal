// Generated from hlsl/shadow.hlsl, entry shadow, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"
#pragma clang diagnostic ignored "-Wunused-variable"

#include <metal_stdlib>
#include <simd/simd.h>
#include <metal_atomic>

using namespace metal;

struct Rows3
{
    float3 row0;
    float3 row1;
    float3 row2;
};

struct ShadowPoint
{
    float2 texel;
    float _distance;
    float scale;
};

struct ShadowConstants
{
    float4 shadow_row0;
    float4 shadow_row1;
    float4 shadow_row2;
    float4 shadow_row3;
    uint count;
};

struct Splats
{
    float4 _data[1];
};

struct Shadow
{
    uint _data[1];
};

static inline __attribute__((always_inline))
ShadowPoint shadow_point(thread const float3& x, thread const float4& row0, thread const float4& row1, thread const float4& row2, thread const float4& row3)
{
    float4 at = float4(x, 1.0);
    ShadowPoint p;
    p.scale = 1.0 / dot(row3, at);
    p.texel = float2(dot(row0, at), dot(row1, at)) * p.scale;
    p._distance = dot(row2, at);
    return p;
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
float3 rotate_inverse(thread const Rows3& m, thread const float3& v)
{
    return ((m.row0 * v.x) + (m.row1 * v.y)) + (m.row2 * v.z);
}

static inline __attribute__((always_inline))
void _shadow(thread const uint3& id, constant ShadowConstants& constants, const device Splats& Splats_1, device Shadow& Shadow_1)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    float4 mean = Splats_1._data[row];
    float3 param = mean.xyz;
    float4 param_1 = constants.shadow_row0;
    float4 param_2 = constants.shadow_row1;
    float4 param_3 = constants.shadow_row2;
    float4 param_4 = constants.shadow_row3;
    ShadowPoint p = shadow_point(param, param_1, param_2, param_3, param_4);
    float most = 2.0 * log(fast::max(mean.w, 1.0000000031710768509710513471353e-30) / 0.300000011920928955078125);
    float3 across = (constants.shadow_row0.xyz - (constants.shadow_row3.xyz * p.texel.x)) * p.scale;
    float3 down = (constants.shadow_row1.xyz - (constants.shadow_row3.xyz * p.texel.y)) * p.scale;
    float3 scale = float3(((device float*)&Splats_1._data[(2u * constants.count) + row])[3u], ((device float*)&Splats_1._data[(3u * constants.count) + row])[3u], ((device float*)&Splats_1._data[(4u * constants.count) + row])[3u]);
    float4 param_5 = Splats_1._data[constants.count + row];
    Rows3 turn = matrix_from_quat(param_5);
    Rows3 param_6 = turn;
    float3 param_7 = across;
    float3 u = rotate_inverse(param_6, param_7) * scale;
    Rows3 param_8 = turn;
    float3 param_9 = down;
    float3 v = rotate_inverse(param_8, param_9) * scale;
    float xx = dot(u, u) + 0.25;
    float xy = dot(u, v);
    float yy = dot(v, v) + 0.25;
    float det = (xx * yy) - (xy * xy);
    if (((!(most > 0.0)) || (!(p._distance > 0.0))) || (!(det > 0.0)))
    {
        return;
    }
    Rows3 param_10 = turn;
    float3 param_11 = constants.shadow_row2.xyz;
    float3 away = rotate_inverse(param_10, param_11) * scale;
    float away_x = dot(away, u);
    float away_y = dot(away, v);
    float2 slope = float2((yy * away_x) - (xy * away_y), (xx * away_y) - (xy * away_x)) / float2(det);
    float2 reach = fast::min(sqrt(float2(xx, yy) * most), float2(12.0));
    float last = 255.0;
    float2 low = fast::clamp(ceil(p.texel - reach), float2(0.0), float2(last + 1.0));
    float2 high = fast::clamp(floor(p.texel + reach), float2(-1.0), float2(last));
    for (float y = low.y; y <= high.y; y += 1.0)
    {
        for (float x = low.x; x <= high.x; x += 1.0)
        {
            float2 d = float2(x, y) - p.texel;
            if (((d.x * ((yy * d.x) - ((2.0 * xy) * d.y))) + ((xx * d.y) * d.y)) <= (most * det))
            {
                float _distance = fast::max(p._distance + dot(slope, d), 0.0);
                uint _519 = atomic_fetch_min_explicit((device atomic_uint*)&Shadow_1._data[(uint(y) * 256u) + uint(x)], as_type<uint>(_distance), memory_order_relaxed);
            }
        }
    }
}

kernel void shadow(const device Splats& Splats_1 [[buffer(0)]], device Shadow& Shadow_1 [[buffer(1)]], constant ShadowConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _shadow(param, constants, Splats_1, Shadow_1);
}

