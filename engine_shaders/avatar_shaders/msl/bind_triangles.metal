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
    uint triangle_plane;
    uint canonical_frame;
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
float3 corner(thread const uint& plane, thread const uint& row, const device SurfaceStatic& SurfaceStatic_1, constant BindTrianglesConstants& constants, const device Mesh& Mesh_1)
{
    return Mesh_1._data[SurfaceStatic_1._data[(constants.triangle_plane + (plane * constants.triangles)) + row]].xyz;
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
float canonical_axis(thread const uint& plane, thread const uint& row, const device SurfaceStatic& SurfaceStatic_1, constant BindTrianglesConstants& constants)
{
    return as_type<float>(SurfaceStatic_1._data[(constants.canonical_frame + (plane * constants.triangles)) + row]);
}

static inline __attribute__((always_inline))
Rows3 canonical_rows(thread const uint& row, const device SurfaceStatic& SurfaceStatic_1, constant BindTrianglesConstants& constants)
{
    uint param = 0u;
    uint param_1 = row;
    uint param_2 = 1u;
    uint param_3 = row;
    uint param_4 = 2u;
    uint param_5 = row;
    Rows3 m;
    m.row0 = float3(canonical_axis(param, param_1, SurfaceStatic_1, constants), canonical_axis(param_2, param_3, SurfaceStatic_1, constants), canonical_axis(param_4, param_5, SurfaceStatic_1, constants));
    uint param_6 = 3u;
    uint param_7 = row;
    uint param_8 = 4u;
    uint param_9 = row;
    uint param_10 = 5u;
    uint param_11 = row;
    m.row1 = float3(canonical_axis(param_6, param_7, SurfaceStatic_1, constants), canonical_axis(param_8, param_9, SurfaceStatic_1, constants), canonical_axis(param_10, param_11, SurfaceStatic_1, constants));
    uint param_12 = 6u;
    uint param_13 = row;
    uint param_14 = 7u;
    uint param_15 = row;
    uint param_16 = 8u;
    uint param_17 = row;
    m.row2 = float3(canonical_axis(param_12, param_13, SurfaceStatic_1, constants), canonical_axis(param_14, param_15, SurfaceStatic_1, constants), canonical_axis(param_16, param_17, SurfaceStatic_1, constants));
    return m;
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
    float3 p0 = corner(param, param_1, SurfaceStatic_1, constants, Mesh_1);
    uint param_2 = 1u;
    uint param_3 = row;
    float3 p1 = corner(param_2, param_3, SurfaceStatic_1, constants, Mesh_1);
    uint param_4 = 2u;
    uint param_5 = row;
    float3 p2 = corner(param_4, param_5, SurfaceStatic_1, constants, Mesh_1);
    TriangleShape shape;
    float4 turn;
    if (constants.rotation_rule == 2u)
    {
        float3 param_6 = p0;
        float3 param_7 = p1;
        float3 param_8 = p2;
        shape = triangle_by_edge(param_6, param_7, param_8);
        Rows3 param_9 = shape.frame;
        turn = quat_from_matrix(param_9);
    }
    else
    {
        float3 param_10 = p0;
        float3 param_11 = p1;
        float3 param_12 = p2;
        shape = triangle_by_area(param_10, param_11, param_12);
        uint param_13 = row;
        Rows3 param_14 = shape.frame;
        Rows3 param_15 = canonical_rows(param_13, SurfaceStatic_1, constants);
        uint param_16 = constants.quaternion_sign;
        turn = triangle_turn(param_14, param_15, param_16);
    }
    Triangles_1._data[row] = float4(shape.across, shape.size);
    Triangles_1._data[constants.triangles + row] = turn;
}

kernel void bind_triangles(const device SurfaceStatic& SurfaceStatic_1 [[buffer(0)]], const device Mesh& Mesh_1 [[buffer(1)]], device Triangles& Triangles_1 [[buffer(2)]], constant BindTrianglesConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _bind_triangles(param, SurfaceStatic_1, constants, Mesh_1, Triangles_1);
}

