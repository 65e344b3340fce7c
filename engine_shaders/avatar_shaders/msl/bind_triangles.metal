// Generated from hlsl/bind_triangles.hlsl, entry bind_triangles, by `python -m avatar_shaders`; do not edit.
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

struct TriangleShape
{
    Rows3 frame;
    float size;
    float3 across;
};

struct SurfaceStatic
{
    uint _data[1];
};

struct BindTrianglesConstants
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
};

struct Mesh
{
    float4 _data[1];
};

struct Triangles
{
    float4 _data[1];
};

static inline __attribute__((always_inline))
uint packed_element(thread const uint& word, thread const uint& bit, thread const uint& width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

static inline __attribute__((always_inline))
uint surface_code(thread const uint& section, thread const uint& index, thread const uint& width, const device SurfaceStatic& SurfaceStatic_1)
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

static inline __attribute__((always_inline))
uint corner(thread const uint& plane, thread const uint& row, const device SurfaceStatic& SurfaceStatic_1, constant BindTrianglesConstants& constants)
{
    uint param = constants.corners;
    uint param_1 = (plane * constants.triangles) + row;
    uint param_2 = constants.corners_width;
    return surface_code(param, param_1, param_2, SurfaceStatic_1);
}

static inline __attribute__((always_inline))
float surface_linear(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& scale, const device SurfaceStatic& SurfaceStatic_1)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = surface_code(param, param_1, param_2, SurfaceStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    return as_type<float>(SurfaceStatic_1._data[scale]) + (as_type<float>(SurfaceStatic_1._data[scale + 1u]) * float(code));
}

static inline __attribute__((always_inline))
float3 surface_linear3(thread const uint& section, thread const uint& index, thread const uint& stride, thread const uint& width, thread const uint& scale, const device SurfaceStatic& SurfaceStatic_1)
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
    return float3(surface_linear(param, param_1, param_2, param_3, SurfaceStatic_1), surface_linear(param_4, param_5, param_6, param_7, SurfaceStatic_1), surface_linear(param_8, param_9, param_10, param_11, SurfaceStatic_1));
}

static inline __attribute__((always_inline))
float3 canonical_position(thread const uint& vertex0, const device SurfaceStatic& SurfaceStatic_1, constant BindTrianglesConstants& constants)
{
    uint param = constants.canonical;
    uint param_1 = vertex0;
    uint param_2 = constants.vertices;
    uint param_3 = constants.canonical_width;
    uint param_4 = constants.canonical_scale;
    return surface_linear3(param, param_1, param_2, param_3, param_4, SurfaceStatic_1);
}

static inline __attribute__((always_inline))
float3 bind_unit(thread const float3& v)
{
    return v / float3(fast::max(length(v), 1.0000000031710768509710513471353e-30));
}

static inline __attribute__((always_inline))
Rows3 bind_columns(thread const float3& x, thread const float3& y, thread const float3& z)
{
    Rows3 m;
    m.row0 = float3(x.x, y.x, z.x);
    m.row1 = float3(x.y, y.y, z.y);
    m.row2 = float3(x.z, y.z, z.z);
    return m;
}

static inline __attribute__((always_inline))
TriangleShape triangle_by_edge(thread const float3& p0, thread const float3& p1, thread const float3& p2)
{
    float3 e = p1 - p0;
    float3 f = p2 - p0;
    TriangleShape t;
    t.across = cross(e, f);
    float3 param = e;
    float3 a0 = bind_unit(param);
    float3 param_1 = cross(a0, f);
    float3 a1 = bind_unit(param_1);
    float3 param_2 = cross(a1, a0);
    float3 a2 = -bind_unit(param_2);
    float3 param_3 = a0;
    float3 param_4 = a1;
    float3 param_5 = a2;
    t.frame = bind_columns(param_3, param_4, param_5);
    t.size = (length(e) + abs(dot(a2, f))) / 2.0;
    return t;
}

static inline __attribute__((always_inline))
float4 quat_from_matrix(thread const Rows3& m)
{
    float d0 = m.row0.x;
    float d1 = m.row1.y;
    float d2 = m.row2.z;
    float4 size = sqrt(fast::max(float4(((1.0 + d0) + d1) + d2, ((1.0 + d0) - d1) - d2, ((1.0 - d0) + d1) - d2, ((1.0 - d0) - d1) + d2), float4(0.0)));
    float a = m.row2.y - m.row1.z;
    float b = m.row0.z - m.row2.x;
    float c = m.row1.x - m.row0.y;
    float d = m.row1.x + m.row0.y;
    float e = m.row0.z + m.row2.x;
    float f = m.row2.y + m.row1.z;
    if (((size.x >= size.y) && (size.x >= size.z)) && (size.x >= size.w))
    {
        return float4(size.x * size.x, a, b, c) / float4(2.0 * size.x);
    }
    if ((size.y >= size.z) && (size.y >= size.w))
    {
        return float4(a, size.y * size.y, d, e) / float4(2.0 * size.y);
    }
    if (size.z >= size.w)
    {
        return float4(b, d, size.z * size.z, f) / float4(2.0 * size.z);
    }
    return float4(c, e, f, size.w * size.w) / float4(2.0 * size.w);
}

static inline __attribute__((always_inline))
TriangleShape triangle_by_area(thread const float3& p0, thread const float3& p1, thread const float3& p2)
{
    float3 e = p1 - p0;
    TriangleShape t;
    t.across = cross(e, p2 - p0);
    float3 param = t.across;
    float3 param_1 = cross(e, bind_unit(param));
    float3 x = bind_unit(param_1);
    float3 param_2 = cross(e, x);
    float3 param_3 = e;
    float3 param_4 = x;
    float3 param_5 = bind_unit(param_2);
    float3 param_6 = bind_unit(param_3);
    t.frame = bind_columns(param_4, param_5, param_6);
    t.size = length(t.across) / 2.0;
    return t;
}

static inline __attribute__((always_inline))
float3 rotate(thread const Rows3& m, thread const float3& v)
{
    return float3(dot(m.row0, v), dot(m.row1, v), dot(m.row2, v));
}

static inline __attribute__((always_inline))
Rows3 multiply_transposed(thread const Rows3& a, thread const Rows3& b)
{
    Rows3 param = b;
    float3 param_1 = a.row0;
    Rows3 r;
    r.row0 = rotate(param, param_1);
    Rows3 param_2 = b;
    float3 param_3 = a.row1;
    r.row1 = rotate(param_2, param_3);
    Rows3 param_4 = b;
    float3 param_5 = a.row2;
    r.row2 = rotate(param_4, param_5);
    return r;
}

static inline __attribute__((always_inline))
float4 triangle_turn(thread const Rows3& frame, thread const Rows3& canonical_frame, thread const uint& quaternion_sign)
{
    Rows3 param = frame;
    Rows3 param_1 = canonical_frame;
    Rows3 param_2 = multiply_transposed(param, param_1);
    float4 turn = quat_from_matrix(param_2);
    bool negative = (quaternion_sign == 1u) && (turn.x < 0.0);
    if (quaternion_sign == 2u)
    {
        negative = fast::max(turn.z, turn.w) > fast::max(turn.x, turn.y);
    }
    return select(turn, -turn, bool4(negative));
}

static inline __attribute__((always_inline))
void _bind_triangles(thread const uint3& id, const device SurfaceStatic& SurfaceStatic_1, constant BindTrianglesConstants& constants, const device Mesh& Mesh_1, device Triangles& Triangles_1)
{
    uint row = id.x;
    if (row >= constants.triangles)
    {
        return;
    }
    uint param = 0u;
    uint param_1 = row;
    uint v0 = corner(param, param_1, SurfaceStatic_1, constants);
    uint param_2 = 1u;
    uint param_3 = row;
    uint v1 = corner(param_2, param_3, SurfaceStatic_1, constants);
    uint param_4 = 2u;
    uint param_5 = row;
    uint v2 = corner(param_4, param_5, SurfaceStatic_1, constants);
    float3 p0 = Mesh_1._data[v0].xyz;
    float3 p1 = Mesh_1._data[v1].xyz;
    float3 p2 = Mesh_1._data[v2].xyz;
    uint param_6 = v0;
    float3 c0 = canonical_position(param_6, SurfaceStatic_1, constants);
    uint param_7 = v1;
    float3 c1 = canonical_position(param_7, SurfaceStatic_1, constants);
    uint param_8 = v2;
    float3 c2 = canonical_position(param_8, SurfaceStatic_1, constants);
    TriangleShape shape;
    TriangleShape rest;
    float4 turn;
    if (constants.rotation_rule == 2u)
    {
        float3 param_9 = p0;
        float3 param_10 = p1;
        float3 param_11 = p2;
        shape = triangle_by_edge(param_9, param_10, param_11);
        float3 param_12 = c0;
        float3 param_13 = c1;
        float3 param_14 = c2;
        rest = triangle_by_edge(param_12, param_13, param_14);
        Rows3 param_15 = shape.frame;
        turn = quat_from_matrix(param_15);
    }
    else
    {
        float3 param_16 = p0;
        float3 param_17 = p1;
        float3 param_18 = p2;
        shape = triangle_by_area(param_16, param_17, param_18);
        float3 param_19 = c0;
        float3 param_20 = c1;
        float3 param_21 = c2;
        rest = triangle_by_area(param_19, param_20, param_21);
        Rows3 param_22 = shape.frame;
        Rows3 param_23 = rest.frame;
        uint param_24 = constants.quaternion_sign;
        turn = triangle_turn(param_22, param_23, param_24);
    }
    Triangles_1._data[row] = float4(shape.across, shape.size);
    Triangles_1._data[constants.triangles + row] = turn;
    Triangles_1._data[(2u * constants.triangles) + row] = float4(rest.size, float(v0), float(v1), float(v2));
}

kernel void bind_triangles(const device SurfaceStatic& SurfaceStatic_1 [[buffer(0)]], const device Mesh& Mesh_1 [[buffer(1)]], device Triangles& Triangles_1 [[buffer(2)]], constant BindTrianglesConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _bind_triangles(param, SurfaceStatic_1, constants, Mesh_1, Triangles_1);
}

