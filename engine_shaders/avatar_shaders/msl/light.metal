// Generated from hlsl/light.hlsl, entry light, by `python -m avatar_shaders`; do not edit.
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

struct ShadowPoint
{
    float2 texel;
    float _distance;
    float scale;
};

struct LightStatic
{
    uint _data[1];
};

struct LightConstants
{
    uint count;
    uint normal;
    uint normal_width;
    uint normal_scale;
    float4 turn_row0;
    float4 turn_row1;
    float4 turn_row2;
    float4 capture_ambient0;
    float4 capture_ambient1;
    float4 capture_ambient2;
    float4 capture_ambient3;
    float4 capture_ambient4;
    float4 capture_ambient5;
    float4 capture_ambient6;
    float4 capture_ambient7;
    float4 capture_ambient8;
    float4 scene_ambient0;
    float4 scene_ambient1;
    float4 scene_ambient2;
    float4 scene_ambient3;
    float4 scene_ambient4;
    float4 scene_ambient5;
    float4 scene_ambient6;
    float4 scene_ambient7;
    float4 scene_ambient8;
    float4 place0;
    float4 place1;
    float4 place2;
    float4 place3;
    float4 colour0;
    float4 colour1;
    float4 colour2;
    float4 colour3;
    float4 shadow_row0;
    float4 shadow_row1;
    float4 shadow_row2;
    float4 shadow_row3;
    float4 shadow_offset;
    uint turned;
};

struct Projected
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
uint light_code(thread const uint& section, thread const uint& index, thread const uint& width, const device LightStatic& LightStatic_1)
{
    if (width == 32u)
    {
        return LightStatic_1._data[section + index];
    }
    uint bit = index * width;
    uint param = LightStatic_1._data[section + (bit >> uint(5))];
    uint param_1 = bit;
    uint param_2 = width;
    return packed_element(param, param_1, param_2);
}

static inline __attribute__((always_inline))
float light_linear(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& scale, const device LightStatic& LightStatic_1)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = light_code(param, param_1, param_2, LightStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    return as_type<float>(LightStatic_1._data[scale]) + (as_type<float>(LightStatic_1._data[scale + 1u]) * float(code));
}

static inline __attribute__((always_inline))
float3 light_linear3(thread const uint& section, thread const uint& index, thread const uint& stride, thread const uint& width, thread const uint& scale, const device LightStatic& LightStatic_1)
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
    return float3(light_linear(param, param_1, param_2, param_3, LightStatic_1), light_linear(param_4, param_5, param_6, param_7, LightStatic_1), light_linear(param_8, param_9, param_10, param_11, LightStatic_1));
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
float3 rotate(thread const Rows3& m, thread const float3& v)
{
    return float3(dot(m.row0, v), dot(m.row1, v), dot(m.row2, v));
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
float3 light_ambient(thread const float3& n, thread const float3& a0, thread const float3& a1, thread const float3& a2, thread const float3& a3, thread const float3& a4, thread const float3& a5, thread const float3& a6, thread const float3& a7, thread const float3& a8)
{
    float3 param = a0;
    float3 param_1 = n;
    float3 param_2 = a1;
    float3 param_3 = a2;
    float3 param_4 = a3;
    float3 param_5 = n;
    float3 param_6 = a4;
    float3 param_7 = a5;
    float3 param_8 = a6;
    float3 param_9 = a7;
    float3 param_10 = a8;
    return (sh_band0(param) + sh_band1(param_1, param_2, param_3, param_4)) + sh_band2(param_5, param_6, param_7, param_8, param_9, param_10);
}

static inline __attribute__((always_inline))
float3 light_direct(thread const float3& n, thread const float3& x, thread const float4& place, thread const float3& colour)
{
    float3 to = place.xyz - (x * place.w);
    float squared = dot(to, to);
    float facing = fast::max(dot(n, to) / sqrt(fast::max(squared, 1.0000000031710768509710513471353e-30)), 0.0);
    return colour * ((place.w != 0.0) ? (facing / fast::max(squared, 9.9999997473787516355514526367188e-05)) : facing);
}

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
float shadow_weight(thread const uint& i, thread const float& part)
{
    return ((i == 0u) ? (1.0 - part) : ((i == 3u) ? part : 1.0)) / 3.0;
}

static inline __attribute__((always_inline))
float light_seen(thread const float3& x, thread const float3& n, constant LightConstants& constants, const device LightStatic& Shadow)
{
    if (constants.shadow_offset.z == 0.0)
    {
        return 1.0;
    }
    float3 param = x + (n * constants.shadow_offset.x);
    float4 param_1 = constants.shadow_row0;
    float4 param_2 = constants.shadow_row1;
    float4 param_3 = constants.shadow_row2;
    float4 param_4 = constants.shadow_row3;
    ShadowPoint p = shadow_point(param, param_1, param_2, param_3, param_4);
    float2 first = floor(p.texel);
    float2 part = p.texel - first;
    float seen = 0.0;
    for (uint i = 0u; i < 16u; i++)
    {
        float2 at = (first + float2(float(i % 4u), float(i / 4u))) - float2(1.0);
        float last = 255.0;
        bool inside = (((at.x >= 0.0) && (at.y >= 0.0)) && (at.x <= last)) && (at.y <= last);
        uint texel = inside ? ((uint(at.y) * 256u) + uint(at.x)) : 0u;
        bool lit = (!inside) || (as_type<float>(Shadow._data[texel]) >= (p._distance - constants.shadow_offset.y));
        uint param_5 = i % 4u;
        float param_6 = part.x;
        uint param_7 = i / 4u;
        float param_8 = part.y;
        seen += (lit ? (shadow_weight(param_5, param_6) * shadow_weight(param_7, param_8)) : 0.0);
    }
    return seen;
}

static inline __attribute__((always_inline))
float3 light_scene(thread const float3& n, thread const float3& x, constant LightConstants& constants, const device LightStatic& Shadow)
{
    float3 param = n;
    float3 param_1 = constants.scene_ambient0.xyz;
    float3 param_2 = constants.scene_ambient1.xyz;
    float3 param_3 = constants.scene_ambient2.xyz;
    float3 param_4 = constants.scene_ambient3.xyz;
    float3 param_5 = constants.scene_ambient4.xyz;
    float3 param_6 = constants.scene_ambient5.xyz;
    float3 param_7 = constants.scene_ambient6.xyz;
    float3 param_8 = constants.scene_ambient7.xyz;
    float3 param_9 = constants.scene_ambient8.xyz;
    float3 light = light_ambient(param, param_1, param_2, param_3, param_4, param_5, param_6, param_7, param_8, param_9);
    float3 param_10 = n;
    float3 param_11 = x;
    float4 param_12 = constants.place0;
    float3 param_13 = constants.colour0.xyz;
    float3 param_14 = x;
    float3 param_15 = n;
    light += (light_direct(param_10, param_11, param_12, param_13) * light_seen(param_14, param_15, constants, Shadow));
    float3 param_16 = n;
    float3 param_17 = x;
    float4 param_18 = constants.place1;
    float3 param_19 = constants.colour1.xyz;
    light += light_direct(param_16, param_17, param_18, param_19);
    float3 param_20 = n;
    float3 param_21 = x;
    float4 param_22 = constants.place2;
    float3 param_23 = constants.colour2.xyz;
    light += light_direct(param_20, param_21, param_22, param_23);
    float3 param_24 = n;
    float3 param_25 = x;
    float4 param_26 = constants.place3;
    float3 param_27 = constants.colour3.xyz;
    return light + light_direct(param_24, param_25, param_26, param_27);
}

static inline __attribute__((always_inline))
float light_power(thread const float& x, thread const float& exponent)
{
    return (x > 0.0) ? exp(exponent * log(x)) : 0.0;
}

static inline __attribute__((always_inline))
float light_channel(thread const float& display, thread const float& ratio)
{
    if (display > 0.040449999272823333740234375)
    {
        float param = ratio;
        float param_1 = 0.4166666567325592041015625;
        float raised = (display + 0.054999999701976776123046875) * light_power(param, param_1);
        float param_2 = raised / 1.05499994754791259765625;
        float param_3 = 2.400000095367431640625;
        return (raised > 0.09544999897480010986328125) ? (raised - 0.054999999701976776123046875) : (12.9200000762939453125 * light_power(param_2, param_3));
    }
    float lit = (display / 12.9200000762939453125) * ratio;
    float param_4 = lit;
    float param_5 = 0.4166666567325592041015625;
    return (lit <= 0.003130800090730190277099609375) ? (12.9200000762939453125 * lit) : ((1.05499994754791259765625 * light_power(param_4, param_5)) - 0.054999999701976776123046875);
}

static inline __attribute__((always_inline))
float3 light_colour(thread const float3& display, thread const float3& scene, thread const float3& capture)
{
    float3 ratio = fast::max(scene, float3(0.0)) / fast::max(capture, float3(0.0500000007450580596923828125));
    if (((ratio.x == 1.0) && (ratio.y == 1.0)) && (ratio.z == 1.0))
    {
        return display;
    }
    float param = display.x;
    float param_1 = ratio.x;
    float param_2 = display.y;
    float param_3 = ratio.y;
    float param_4 = display.z;
    float param_5 = ratio.z;
    return float3(light_channel(param, param_1), light_channel(param_2, param_3), light_channel(param_4, param_5));
}

static inline __attribute__((always_inline))
void _light(thread const uint3& id, const device LightStatic& LightStatic_1, constant LightConstants& constants, const device LightStatic& Shadow, device Projected& Projected_1, const device Splats& Splats_1)
{
    uint row = id.x;
    if ((row >= constants.count) || (!(((device float*)&Projected_1._data[constants.count + row])[3u] > 0.0)))
    {
        return;
    }
    float3 n;
    if (constants.turned != 0u)
    {
        n = Splats_1._data[(5u * constants.count) + row].xyz;
    }
    else
    {
        uint param = constants.normal;
        uint param_1 = row;
        uint param_2 = constants.count;
        uint param_3 = constants.normal_width;
        uint param_4 = constants.normal_scale;
        n = light_linear3(param, param_1, param_2, param_3, param_4, LightStatic_1);
        float4 param_5 = Splats_1._data[constants.count + row];
        Rows3 param_6 = matrix_from_quat(param_5);
        float3 param_7 = n;
        n = rotate(param_6, param_7);
    }
    n /= float3(fast::max(length(n), 1.0000000031710768509710513471353e-30));
    float3 param_8 = n;
    float3 param_9 = Splats_1._data[row].xyz;
    float3 scene = light_scene(param_8, param_9, constants, Shadow);
    float3 captured = float3(dot(constants.turn_row0.xyz, n), dot(constants.turn_row1.xyz, n), dot(constants.turn_row2.xyz, n));
    float3 param_10 = captured;
    float3 param_11 = constants.capture_ambient0.xyz;
    float3 param_12 = constants.capture_ambient1.xyz;
    float3 param_13 = constants.capture_ambient2.xyz;
    float3 param_14 = constants.capture_ambient3.xyz;
    float3 param_15 = constants.capture_ambient4.xyz;
    float3 param_16 = constants.capture_ambient5.xyz;
    float3 param_17 = constants.capture_ambient6.xyz;
    float3 param_18 = constants.capture_ambient7.xyz;
    float3 param_19 = constants.capture_ambient8.xyz;
    float3 capture = light_ambient(param_10, param_11, param_12, param_13, param_14, param_15, param_16, param_17, param_18, param_19);
    float4 colour = Projected_1._data[(2u * constants.count) + row];
    float3 param_20 = colour.xyz;
    float3 param_21 = scene;
    float3 param_22 = capture;
    Projected_1._data[(2u * constants.count) + row] = float4(light_colour(param_20, param_21, param_22), colour.w);
}

kernel void light(const device LightStatic& LightStatic_1 [[buffer(0)]], const device Splats& Splats_1 [[buffer(1)]], const device LightStatic& Shadow [[buffer(2)]], device Projected& Projected_1 [[buffer(3)]], constant LightConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _light(param, LightStatic_1, constants, Shadow, Projected_1, Splats_1);
}

