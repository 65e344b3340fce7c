#version 430
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
    uint triangle_plane;
    uint canonical_frame;
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

vec3 corner(uint plane, uint row)
{
    return Mesh_1._data[SurfaceStatic_1._data[(constants.triangle_plane + (plane * constants.triangles)) + row]].xyz;
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

float canonical_axis(uint plane, uint row)
{
    return uintBitsToFloat(SurfaceStatic_1._data[(constants.canonical_frame + (plane * constants.triangles)) + row]);
}

Rows3 canonical_rows(uint row)
{
    uint param = 0u;
    uint param_1 = row;
    uint param_2 = 1u;
    uint param_3 = row;
    uint param_4 = 2u;
    uint param_5 = row;
    Rows3 m;
    m.row0 = vec3(canonical_axis(param, param_1), canonical_axis(param_2, param_3), canonical_axis(param_4, param_5));
    uint param_6 = 3u;
    uint param_7 = row;
    uint param_8 = 4u;
    uint param_9 = row;
    uint param_10 = 5u;
    uint param_11 = row;
    m.row1 = vec3(canonical_axis(param_6, param_7), canonical_axis(param_8, param_9), canonical_axis(param_10, param_11));
    uint param_12 = 6u;
    uint param_13 = row;
    uint param_14 = 7u;
    uint param_15 = row;
    uint param_16 = 8u;
    uint param_17 = row;
    m.row2 = vec3(canonical_axis(param_12, param_13), canonical_axis(param_14, param_15), canonical_axis(param_16, param_17));
    return m;
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
    vec4 _467 = -turn;
    bvec4 _470 = bvec4(negative);
    return vec4(_470.x ? _467.x : turn.x, _470.y ? _467.y : turn.y, _470.z ? _467.z : turn.z, _470.w ? _467.w : turn.w);
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
    vec3 p0 = corner(param, param_1);
    uint param_2 = 1u;
    uint param_3 = row;
    vec3 p1 = corner(param_2, param_3);
    uint param_4 = 2u;
    uint param_5 = row;
    vec3 p2 = corner(param_4, param_5);
    TriangleShape shape;
    vec4 turn;
    if (constants.rotation_rule == 2u)
    {
        vec3 param_6 = p0;
        vec3 param_7 = p1;
        vec3 param_8 = p2;
        shape = triangle_by_edge(param_6, param_7, param_8);
        Rows3 param_9 = shape.frame;
        turn = quat_from_matrix(param_9);
    }
    else
    {
        vec3 param_10 = p0;
        vec3 param_11 = p1;
        vec3 param_12 = p2;
        shape = triangle_by_area(param_10, param_11, param_12);
        uint param_13 = row;
        Rows3 param_14 = shape.frame;
        Rows3 param_15 = canonical_rows(param_13);
        uint param_16 = constants.quaternion_sign;
        turn = triangle_turn(param_14, param_15, param_16);
    }
    Triangles_1._data[row] = vec4(shape.across, shape.size);
    Triangles_1._data[constants.triangles + row] = turn;
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _bind_triangles(param);
}

