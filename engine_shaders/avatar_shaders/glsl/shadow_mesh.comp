#version 310 es
// Generated from hlsl/shadow_mesh.hlsl, entry shadow_mesh, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

struct Rows4
{
    vec4 row0;
    vec4 row1;
    vec4 row2;
};

struct ShadowPoint
{
    vec2 texel;
    float _distance;
    float scale;
};

layout(binding = 0, std430) readonly buffer CornerStatic
{
    uint _data[];
} CornerStatic_1;

layout(binding = 8, std140) uniform ShadowMeshConstants
{
    uint triangles;
    uint vertices;
    uint corners;
    uint corners_width;
    vec4 world_row0;
    vec4 world_row1;
    vec4 world_row2;
    vec4 shadow_row0;
    vec4 shadow_row1;
    vec4 shadow_row2;
    vec4 shadow_row3;
} constants;

layout(binding = 1, std430) readonly buffer Mesh
{
    vec4 _data[];
} Mesh_1;

layout(binding = 2, std430) buffer Shadow
{
    uint _data[];
} Shadow_1;

uint packed_element(uint word, uint bit, uint width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

uint corner_code(uint section, uint index, uint width)
{
    if (width == 32u)
    {
        return CornerStatic_1._data[section + index];
    }
    uint bit = index * width;
    uint param = CornerStatic_1._data[section + (bit >> uint(5))];
    uint param_1 = bit;
    uint param_2 = width;
    return packed_element(param, param_1, param_2);
}

vec3 transform_point(Rows4 m, vec3 p)
{
    return vec3((((m.row0.x * p.x) + (m.row0.y * p.y)) + (m.row0.z * p.z)) + m.row0.w, (((m.row1.x * p.x) + (m.row1.y * p.y)) + (m.row1.z * p.z)) + m.row1.w, (((m.row2.x * p.x) + (m.row2.y * p.y)) + (m.row2.z * p.z)) + m.row2.w);
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

ShadowPoint shadow_corner(uint at)
{
    Rows4 world;
    world.row0 = constants.world_row0;
    world.row1 = constants.world_row1;
    world.row2 = constants.world_row2;
    uint param = constants.corners;
    uint param_1 = at;
    uint param_2 = constants.corners_width;
    Rows4 param_3 = world;
    vec3 param_4 = Mesh_1._data[corner_code(param, param_1, param_2)].xyz;
    vec3 x = transform_point(param_3, param_4);
    vec3 param_5 = x;
    vec4 param_6 = constants.shadow_row0;
    vec4 param_7 = constants.shadow_row1;
    vec4 param_8 = constants.shadow_row2;
    vec4 param_9 = constants.shadow_row3;
    return shadow_point(param_5, param_6, param_7, param_8, param_9);
}

float shadow_side(vec2 from, vec2 to, vec2 at)
{
    return ((to.x - from.x) * (at.y - from.y)) - ((to.y - from.y) * (at.x - from.x));
}

void _shadow_mesh(uvec3 id)
{
    uint t = id.x;
    if (t >= constants.triangles)
    {
        return;
    }
    uint param = t;
    ShadowPoint a = shadow_corner(param);
    uint param_1 = constants.triangles + t;
    ShadowPoint b = shadow_corner(param_1);
    uint param_2 = (2u * constants.triangles) + t;
    ShadowPoint c = shadow_corner(param_2);
    vec2 param_3 = a.texel;
    vec2 param_4 = b.texel;
    vec2 param_5 = c.texel;
    float area = shadow_side(param_3, param_4, param_5);
    if ((!(min(a._distance, min(b._distance, c._distance)) > 0.0)) || (!(abs(area) > 0.0)))
    {
        return;
    }
    float last = 255.0;
    vec2 low = clamp(ceil(min(a.texel, min(b.texel, c.texel))), vec2(0.0), vec2(last + 1.0));
    vec2 high = clamp(floor(max(a.texel, max(b.texel, c.texel))), vec2(-1.0), min(low + vec2(128.0), vec2(last)));
    for (float y = low.y; y <= high.y; y += 1.0)
    {
        for (float x = low.x; x <= high.x; x += 1.0)
        {
            vec2 at = vec2(x, y);
            vec2 param_6 = b.texel;
            vec2 param_7 = c.texel;
            vec2 param_8 = at;
            float u = shadow_side(param_6, param_7, param_8) / area;
            vec2 param_9 = c.texel;
            vec2 param_10 = a.texel;
            vec2 param_11 = at;
            float v = shadow_side(param_9, param_10, param_11) / area;
            vec2 param_12 = a.texel;
            vec2 param_13 = b.texel;
            vec2 param_14 = at;
            float w = shadow_side(param_12, param_13, param_14) / area;
            if (min(u, min(v, w)) >= 0.0)
            {
                float _distance = ((u * a._distance) + (v * b._distance)) + (w * c._distance);
                uint _490 = atomicMin(Shadow_1._data[(uint(y) * 256u) + uint(x)], floatBitsToUint(_distance));
            }
        }
    }
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _shadow_mesh(param);
}

