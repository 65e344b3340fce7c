#version 310 es
// Generated from hlsl/bind_triangles.hlsl, entry bind_triangles, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

struct Rows3
{
    vec3 row0;
    vec3 row1;
    vec3 row2;
};

struct TriangleShape
{
    Rows3 frame;
    float size;
    vec3 across;
};

layout(binding = 0, std430) readonly buffer SurfaceStatic
{
    uint _data[];
} SurfaceStatic_1;

layout(binding = 8, std140) uniform BindTrianglesConstants
{
    uint triangles;
    uint vertices;
    uint corners;
    uint corners_width;
    uint canonical;
    uint canonical_width;
    uint canonical_scale;
    uint rotation_rule;
    uint quaternion_sign;
} constants;

layout(binding = 1, std430) readonly buffer Mesh
{
    vec4 _data[];
} Mesh_1;

layout(binding = 2, std430) buffer Triangles
{
    vec4 _data[];
} Triangles_1;

uint packed_element(uint word, uint bit, uint width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

uint surface_code(uint section, uint index, uint width)
{
    if (width == 32u)
    {
        return SurfaceStatic_1._data[section + index];
    }
    uint bit = index * width;
    uint param = SurfaceStatic_1._data[section + (bit >> uint(5))];
    uint param_1 = bit;
    uint param_2 = width;
    return packed_element(param, param_1, param_2);
}

uint corner(uint plane, uint row)
{
    uint param = constants.corners;
    uint param_1 = (plane * constants.triangles) + row;
    uint param_2 = constants.corners_width;
    return surface_code(param, param_1, param_2);
}

float surface_linear(uint section, uint index, uint width, uint scale)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = surface_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    return uintBitsToFloat(SurfaceStatic_1._data[scale]) + (uintBitsToFloat(SurfaceStatic_1._data[scale + 1u]) * float(code));
}

vec3 surface_linear3(uint section, uint index, uint stride, uint width, uint scale)
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
    return vec3(surface_linear(param, param_1, param_2, param_3), surface_linear(param_4, param_5, param_6, param_7), surface_linear(param_8, param_9, param_10, param_11));
}

vec3 canonical_position(uint vertex)
{
    uint param = constants.canonical;
    uint param_1 = vertex;
    uint param_2 = constants.vertices;
    uint param_3 = constants.canonical_width;
    uint param_4 = constants.canonical_scale;
    return surface_linear3(param, param_1, param_2, param_3, param_4);
}

vec3 bind_unit(vec3 v)
{
    return v / vec3(max(length(v), 1.0000000031710768509710513471353e-30));
}

Rows3 bind_columns(vec3 x, vec3 y, vec3 z)
{
    Rows3 m;
    m.row0 = vec3(x.x, y.x, z.x);
    m.row1 = vec3(x.y, y.y, z.y);
    m.row2 = vec3(x.z, y.z, z.z);
    return m;
}

TriangleShape triangle_by_edge(vec3 p0, vec3 p1, vec3 p2)
{
    vec3 e = p1 - p0;
    vec3 f = p2 - p0;
    TriangleShape t;
    t.across = cross(e, f);
    vec3 param = e;
    vec3 a0 = bind_unit(param);
    vec3 param_1 = cross(a0, f);
    vec3 a1 = bind_unit(param_1);
    vec3 param_2 = cross(a1, a0);
    vec3 a2 = -bind_unit(param_2);
    vec3 param_3 = a0;
    vec3 param_4 = a1;
    vec3 param_5 = a2;
    t.frame = bind_columns(param_3, param_4, param_5);
    t.size = (length(e) + abs(dot(a2, f))) / 2.0;
    return t;
}

vec4 quat_from_matrix(Rows3 m)
{
    float d0 = m.row0.x;
    float d1 = m.row1.y;
    float d2 = m.row2.z;
    vec4 size = sqrt(max(vec4(((1.0 + d0) + d1) + d2, ((1.0 + d0) - d1) - d2, ((1.0 - d0) + d1) - d2, ((1.0 - d0) - d1) + d2), vec4(0.0)));
    float a = m.row2.y - m.row1.z;
    float b = m.row0.z - m.row2.x;
    float c = m.row1.x - m.row0.y;
    float d = m.row1.x + m.row0.y;
    float e = m.row0.z + m.row2.x;
    float f = m.row2.y + m.row1.z;
    if (((size.x >= size.y) && (size.x >= size.z)) && (size.x >= size.w))
    {
        return vec4(size.x * size.x, a, b, c) / vec4(2.0 * size.x);
    }
    if ((size.y >= size.z) && (size.y >= size.w))
    {
        return vec4(a, size.y * size.y, d, e) / vec4(2.0 * size.y);
    }
    if (size.z >= size.w)
    {
        return vec4(b, d, size.z * size.z, f) / vec4(2.0 * size.z);
    }
    return vec4(c, e, f, size.w * size.w) / vec4(2.0 * size.w);
}

TriangleShape triangle_by_area(vec3 p0, vec3 p1, vec3 p2)
{
    vec3 e = p1 - p0;
    TriangleShape t;
    t.across = cross(e, p2 - p0);
    vec3 param = t.across;
    vec3 param_1 = cross(e, bind_unit(param));
    vec3 x = bind_unit(param_1);
    vec3 param_2 = cross(e, x);
    vec3 param_3 = e;
    vec3 param_4 = x;
    vec3 param_5 = bind_unit(param_2);
    vec3 param_6 = bind_unit(param_3);
    t.frame = bind_columns(param_4, param_5, param_6);
    t.size = length(t.across) / 2.0;
    return t;
}

vec3 rotate(Rows3 m, vec3 v)
{
    return vec3(dot(m.row0, v), dot(m.row1, v), dot(m.row2, v));
}

Rows3 multiply_transposed(Rows3 a, Rows3 b)
{
    Rows3 param = b;
    vec3 param_1 = a.row0;
    Rows3 r;
    r.row0 = rotate(param, param_1);
    Rows3 param_2 = b;
    vec3 param_3 = a.row1;
    r.row1 = rotate(param_2, param_3);
    Rows3 param_4 = b;
    vec3 param_5 = a.row2;
    r.row2 = rotate(param_4, param_5);
    return r;
}

vec4 triangle_turn(Rows3 frame, Rows3 canonical_frame, uint quaternion_sign)
{
    Rows3 param = frame;
    Rows3 param_1 = canonical_frame;
    Rows3 param_2 = multiply_transposed(param, param_1);
    vec4 turn = quat_from_matrix(param_2);
    bool negative = (quaternion_sign == 1u) && (turn.x < 0.0);
    if (quaternion_sign == 2u)
    {
        negative = max(turn.z, turn.w) > max(turn.x, turn.y);
    }
    return mix(turn, -turn, bvec4(negative));
}

void _bind_triangles(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.triangles)
    {
        return;
    }
    uint param = 0u;
    uint param_1 = row;
    uint v0 = corner(param, param_1);
    uint param_2 = 1u;
    uint param_3 = row;
    uint v1 = corner(param_2, param_3);
    uint param_4 = 2u;
    uint param_5 = row;
    uint v2 = corner(param_4, param_5);
    vec3 p0 = Mesh_1._data[v0].xyz;
    vec3 p1 = Mesh_1._data[v1].xyz;
    vec3 p2 = Mesh_1._data[v2].xyz;
    uint param_6 = v0;
    vec3 c0 = canonical_position(param_6);
    uint param_7 = v1;
    vec3 c1 = canonical_position(param_7);
    uint param_8 = v2;
    vec3 c2 = canonical_position(param_8);
    TriangleShape shape;
    TriangleShape rest;
    vec4 turn;
    if (constants.rotation_rule == 2u)
    {
        vec3 param_9 = p0;
        vec3 param_10 = p1;
        vec3 param_11 = p2;
        shape = triangle_by_edge(param_9, param_10, param_11);
        vec3 param_12 = c0;
        vec3 param_13 = c1;
        vec3 param_14 = c2;
        rest = triangle_by_edge(param_12, param_13, param_14);
        Rows3 param_15 = shape.frame;
        turn = quat_from_matrix(param_15);
    }
    else
    {
        vec3 param_16 = p0;
        vec3 param_17 = p1;
        vec3 param_18 = p2;
        shape = triangle_by_area(param_16, param_17, param_18);
        vec3 param_19 = c0;
        vec3 param_20 = c1;
        vec3 param_21 = c2;
        rest = triangle_by_area(param_19, param_20, param_21);
        Rows3 param_22 = shape.frame;
        Rows3 param_23 = rest.frame;
        uint param_24 = constants.quaternion_sign;
        turn = triangle_turn(param_22, param_23, param_24);
    }
    Triangles_1._data[row] = vec4(shape.across, shape.size);
    Triangles_1._data[constants.triangles + row] = turn;
    Triangles_1._data[(2u * constants.triangles) + row] = vec4(rest.size, float(v0), float(v1), float(v2));
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _bind_triangles(param);
}

