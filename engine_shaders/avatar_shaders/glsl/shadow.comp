#version 310 es
// Generated from hlsl/shadow.hlsl, entry shadow, by `python -m avatar_shaders`; do not edit.
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

layout(binding = 8, std140) uniform ShadowConstants
{
    vec4 shadow_row0;
    vec4 shadow_row1;
    vec4 shadow_row2;
    vec4 shadow_row3;
    uint count;
} constants;

layout(binding = 0, std430) readonly buffer Splats
{
    vec4 _data[];
} Splats_1;

layout(binding = 1, std430) buffer Shadow
{
    uint _data[];
} Shadow_1;

ShadowPoint shadow_point(vec3 x, vec4 row0, vec4 row1, vec4 row2, vec4 row3)
{
    vec4 at = vec4(x, 1.0);
    ShadowPoint p;
    p.scale = 1.0 / dot(row3, at);
    p.texel = vec2(dot(row0, at), dot(row1, at)) * p.scale;
    p._distance = dot(row2, at);
    return p;
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

vec3 rotate_inverse(Rows3 m, vec3 v)
{
    return ((m.row0 * v.x) + (m.row1 * v.y)) + (m.row2 * v.z);
}

void _shadow(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    vec4 mean = Splats_1._data[row];
    vec3 param = mean.xyz;
    vec4 param_1 = constants.shadow_row0;
    vec4 param_2 = constants.shadow_row1;
    vec4 param_3 = constants.shadow_row2;
    vec4 param_4 = constants.shadow_row3;
    ShadowPoint p = shadow_point(param, param_1, param_2, param_3, param_4);
    float most = 2.0 * log(max(mean.w, 1.0000000031710768509710513471353e-30) / 0.300000011920928955078125);
    vec3 across = (constants.shadow_row0.xyz - (constants.shadow_row3.xyz * p.texel.x)) * p.scale;
    vec3 down = (constants.shadow_row1.xyz - (constants.shadow_row3.xyz * p.texel.y)) * p.scale;
    vec3 scale = vec3(Splats_1._data[(2u * constants.count) + row].w, Splats_1._data[(3u * constants.count) + row].w, Splats_1._data[(4u * constants.count) + row].w);
    vec4 param_5 = Splats_1._data[constants.count + row];
    Rows3 turn = matrix_from_quat(param_5);
    Rows3 param_6 = turn;
    vec3 param_7 = across;
    vec3 u = rotate_inverse(param_6, param_7) * scale;
    Rows3 param_8 = turn;
    vec3 param_9 = down;
    vec3 v = rotate_inverse(param_8, param_9) * scale;
    float xx = dot(u, u) + 0.25;
    float xy = dot(u, v);
    float yy = dot(v, v) + 0.25;
    float det = (xx * yy) - (xy * xy);
    if (((!(most > 0.0)) || (!(p._distance > 0.0))) || (!(det > 0.0)))
    {
        return;
    }
    Rows3 param_10 = turn;
    vec3 param_11 = constants.shadow_row2.xyz;
    vec3 away = rotate_inverse(param_10, param_11) * scale;
    float away_x = dot(away, u);
    float away_y = dot(away, v);
    vec2 slope = vec2((yy * away_x) - (xy * away_y), (xx * away_y) - (xy * away_x)) / vec2(det);
    vec2 reach = min(sqrt(vec2(xx, yy) * most), vec2(12.0));
    float last = 255.0;
    vec2 low = clamp(ceil(p.texel - reach), vec2(0.0), vec2(last + 1.0));
    vec2 high = clamp(floor(p.texel + reach), vec2(-1.0), vec2(last));
    for (float y = low.y; y <= high.y; y += 1.0)
    {
        for (float x = low.x; x <= high.x; x += 1.0)
        {
            vec2 d = vec2(x, y) - p.texel;
            if (((d.x * ((yy * d.x) - ((2.0 * xy) * d.y))) + ((xx * d.y) * d.y)) <= (most * det))
            {
                float _distance = max(p._distance + dot(slope, d), 0.0);
                uint _519 = atomicMin(Shadow_1._data[(uint(y) * 256u) + uint(x)], floatBitsToUint(_distance));
            }
        }
    }
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _shadow(param);
}

