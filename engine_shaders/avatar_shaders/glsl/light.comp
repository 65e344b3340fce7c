#version 310 es
// Generated from hlsl/light.hlsl, entry light, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

struct Rows3
{
    vec3 row0;
    vec3 row1;
    vec3 row2;
};

struct ShadowPoint
{
    vec2 texel;
    float _distance;
    float scale;
};

layout(binding = 0, std430) readonly buffer LightStatic
{
    uint _data[];
} LightStatic_1;

layout(binding = 8, std140) uniform LightConstants
{
    uint count;
    uint normal;
    uint normal_width;
    uint normal_scale;
    vec4 turn_row0;
    vec4 turn_row1;
    vec4 turn_row2;
    vec4 capture_ambient0;
    vec4 capture_ambient1;
    vec4 capture_ambient2;
    vec4 capture_ambient3;
    vec4 capture_ambient4;
    vec4 capture_ambient5;
    vec4 capture_ambient6;
    vec4 capture_ambient7;
    vec4 capture_ambient8;
    vec4 scene_ambient0;
    vec4 scene_ambient1;
    vec4 scene_ambient2;
    vec4 scene_ambient3;
    vec4 scene_ambient4;
    vec4 scene_ambient5;
    vec4 scene_ambient6;
    vec4 scene_ambient7;
    vec4 scene_ambient8;
    vec4 place0;
    vec4 place1;
    vec4 place2;
    vec4 place3;
    vec4 colour0;
    vec4 colour1;
    vec4 colour2;
    vec4 colour3;
    vec4 shadow_row0;
    vec4 shadow_row1;
    vec4 shadow_row2;
    vec4 shadow_row3;
    vec4 shadow_offset;
    uint turned;
} constants;

layout(binding = 2, std430) readonly buffer Shadow
{
    uint _data[];
} Shadow_1;

layout(binding = 3, std430) buffer Projected
{
    vec4 _data[];
} Projected_1;

layout(binding = 1, std430) readonly buffer Splats
{
    vec4 _data[];
} Splats_1;

uint packed_element(uint word, uint bit, uint width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

uint light_code(uint section, uint index, uint width)
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

float light_linear(uint section, uint index, uint width, uint scale)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = light_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    return uintBitsToFloat(LightStatic_1._data[scale]) + (uintBitsToFloat(LightStatic_1._data[scale + 1u]) * float(code));
}

vec3 light_linear3(uint section, uint index, uint stride, uint width, uint scale)
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
    return vec3(light_linear(param, param_1, param_2, param_3), light_linear(param_4, param_5, param_6, param_7), light_linear(param_8, param_9, param_10, param_11));
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

vec3 rotate(Rows3 m, vec3 v)
{
    return vec3(dot(m.row0, v), dot(m.row1, v), dot(m.row2, v));
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

vec3 light_ambient(vec3 n, vec3 a0, vec3 a1, vec3 a2, vec3 a3, vec3 a4, vec3 a5, vec3 a6, vec3 a7, vec3 a8)
{
    vec3 param = a0;
    vec3 param_1 = n;
    vec3 param_2 = a1;
    vec3 param_3 = a2;
    vec3 param_4 = a3;
    vec3 param_5 = n;
    vec3 param_6 = a4;
    vec3 param_7 = a5;
    vec3 param_8 = a6;
    vec3 param_9 = a7;
    vec3 param_10 = a8;
    return (sh_band0(param) + sh_band1(param_1, param_2, param_3, param_4)) + sh_band2(param_5, param_6, param_7, param_8, param_9, param_10);
}

vec3 light_direct(vec3 n, vec3 x, vec4 place, vec3 colour)
{
    vec3 to = place.xyz - (x * place.w);
    float squared = dot(to, to);
    float facing = max(dot(n, to) / sqrt(max(squared, 1.0000000031710768509710513471353e-30)), 0.0);
    return colour * ((place.w != 0.0) ? (facing / max(squared, 9.9999997473787516355514526367188e-05)) : facing);
}

ShadowPoint shadow_point(vec3 x, vec4 row0, vec4 row1, vec4 row2, vec4 row3)
{
    vec4 at = vec4(x, 1.0);
    ShadowPoint p;
    p.scale = 1.0 / dot(row3, at);
    p.texel = vec2(dot(row0, at), dot(row1, at)) * p.scale;
    p._distance = dot(row2, at);
    return p;
}

float shadow_weight(uint i, float part)
{
    return ((i == 0u) ? (1.0 - part) : ((i == 3u) ? part : 1.0)) / 3.0;
}

float light_seen(vec3 x, vec3 n)
{
    if (constants.shadow_offset.z == 0.0)
    {
        return 1.0;
    }
    vec3 param = x + (n * constants.shadow_offset.x);
    vec4 param_1 = constants.shadow_row0;
    vec4 param_2 = constants.shadow_row1;
    vec4 param_3 = constants.shadow_row2;
    vec4 param_4 = constants.shadow_row3;
    ShadowPoint p = shadow_point(param, param_1, param_2, param_3, param_4);
    vec2 first = floor(p.texel);
    vec2 part = p.texel - first;
    float seen = 0.0;
    for (uint i = 0u; i < 16u; i++)
    {
        vec2 at = (first + vec2(float(i % 4u), float(i / 4u))) - vec2(1.0);
        float last = 255.0;
        bool inside = (((at.x >= 0.0) && (at.y >= 0.0)) && (at.x <= last)) && (at.y <= last);
        uint texel = inside ? ((uint(at.y) * 256u) + uint(at.x)) : 0u;
        bool lit = (!inside) || (uintBitsToFloat(Shadow_1._data[texel]) >= (p._distance - constants.shadow_offset.y));
        uint param_5 = i % 4u;
        float param_6 = part.x;
        uint param_7 = i / 4u;
        float param_8 = part.y;
        seen += (lit ? (shadow_weight(param_5, param_6) * shadow_weight(param_7, param_8)) : 0.0);
    }
    return seen;
}

vec3 light_scene(vec3 n, vec3 x)
{
    vec3 param = n;
    vec3 param_1 = constants.scene_ambient0.xyz;
    vec3 param_2 = constants.scene_ambient1.xyz;
    vec3 param_3 = constants.scene_ambient2.xyz;
    vec3 param_4 = constants.scene_ambient3.xyz;
    vec3 param_5 = constants.scene_ambient4.xyz;
    vec3 param_6 = constants.scene_ambient5.xyz;
    vec3 param_7 = constants.scene_ambient6.xyz;
    vec3 param_8 = constants.scene_ambient7.xyz;
    vec3 param_9 = constants.scene_ambient8.xyz;
    vec3 light = light_ambient(param, param_1, param_2, param_3, param_4, param_5, param_6, param_7, param_8, param_9);
    vec3 param_10 = n;
    vec3 param_11 = x;
    vec4 param_12 = constants.place0;
    vec3 param_13 = constants.colour0.xyz;
    vec3 param_14 = x;
    vec3 param_15 = n;
    light += (light_direct(param_10, param_11, param_12, param_13) * light_seen(param_14, param_15));
    vec3 param_16 = n;
    vec3 param_17 = x;
    vec4 param_18 = constants.place1;
    vec3 param_19 = constants.colour1.xyz;
    light += light_direct(param_16, param_17, param_18, param_19);
    vec3 param_20 = n;
    vec3 param_21 = x;
    vec4 param_22 = constants.place2;
    vec3 param_23 = constants.colour2.xyz;
    light += light_direct(param_20, param_21, param_22, param_23);
    vec3 param_24 = n;
    vec3 param_25 = x;
    vec4 param_26 = constants.place3;
    vec3 param_27 = constants.colour3.xyz;
    return light + light_direct(param_24, param_25, param_26, param_27);
}

float light_power(float x, float exponent)
{
    return (x > 0.0) ? exp(exponent * log(x)) : 0.0;
}

float light_channel(float display, float ratio)
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

vec3 light_colour(vec3 display, vec3 scene, vec3 capture)
{
    vec3 ratio = max(scene, vec3(0.0)) / max(capture, vec3(0.0500000007450580596923828125));
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
    return vec3(light_channel(param, param_1), light_channel(param_2, param_3), light_channel(param_4, param_5));
}

void _light(uvec3 id)
{
    uint row = id.x;
    if ((row >= constants.count) || (!(Projected_1._data[constants.count + row].w > 0.0)))
    {
        return;
    }
    vec3 n;
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
        n = light_linear3(param, param_1, param_2, param_3, param_4);
        vec4 param_5 = Splats_1._data[constants.count + row];
        Rows3 param_6 = matrix_from_quat(param_5);
        vec3 param_7 = n;
        n = rotate(param_6, param_7);
    }
    n /= vec3(max(length(n), 1.0000000031710768509710513471353e-30));
    vec3 param_8 = n;
    vec3 param_9 = Splats_1._data[row].xyz;
    vec3 scene = light_scene(param_8, param_9);
    vec3 captured = vec3(dot(constants.turn_row0.xyz, n), dot(constants.turn_row1.xyz, n), dot(constants.turn_row2.xyz, n));
    vec3 param_10 = captured;
    vec3 param_11 = constants.capture_ambient0.xyz;
    vec3 param_12 = constants.capture_ambient1.xyz;
    vec3 param_13 = constants.capture_ambient2.xyz;
    vec3 param_14 = constants.capture_ambient3.xyz;
    vec3 param_15 = constants.capture_ambient4.xyz;
    vec3 param_16 = constants.capture_ambient5.xyz;
    vec3 param_17 = constants.capture_ambient6.xyz;
    vec3 param_18 = constants.capture_ambient7.xyz;
    vec3 param_19 = constants.capture_ambient8.xyz;
    vec3 capture = light_ambient(param_10, param_11, param_12, param_13, param_14, param_15, param_16, param_17, param_18, param_19);
    vec4 colour = Projected_1._data[(2u * constants.count) + row];
    vec3 param_20 = colour.xyz;
    vec3 param_21 = scene;
    vec3 param_22 = capture;
    Projected_1._data[(2u * constants.count) + row] = vec4(light_colour(param_20, param_21, param_22), colour.w);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _light(param);
}

