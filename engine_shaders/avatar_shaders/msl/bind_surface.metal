// Generated from hlsl/bind_surface.hlsl, entry bind_surface, by `python -m avatar_shaders`; do not edit.
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

struct Rows4
{
    float4 row0;
    float4 row1;
    float4 row2;
};

struct BoundSplat
{
    float3 mean;
    float4 quat_wxyz;
    Rows3 sh_rotation;
};

struct TriangleShape
{
    Rows3 frame;
    float size;
    float3 across;
};

struct Foot
{
    uint3 vertex0;
    float3 weight;
};

struct EmbedStatic
{
    uint _data[1];
};

struct BindSurfaceConstants
{
    uint count;
    uint vertices;
    uint triangles;
    uint triangle_ids;
    uint triangle_ids_width;
    uint barycentric;
    uint barycentric_width;
    uint barycentric_scale;
    uint displacement;
    uint displacement_width;
    uint displacement_scale;
    uint local_offset;
    uint local_offset_width;
    uint local_offset_scale;
    uint local_quat;
    uint local_quat_width;
    uint local_quat_scale;
    uint position_rule;
    uint rotation_rule;
    uint scale_rule;
    uint sh_direction;
    uint unused;
    float area_damping;
    float log_training_per_bundle;
    float4 world_row0;
    float4 world_row1;
    float4 world_row2;
    float4 world_quat_wxyz;
};

struct Mesh
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
uint embed_code(thread const uint& section, thread const uint& index, thread const uint& width, const device EmbedStatic& EmbedStatic_1)
{
    if (width == 32u)
    {
        return EmbedStatic_1._data[section + index];
    }
    uint bit = index * width;
    uint param = EmbedStatic_1._data[section + (bit >> uint(5))];
    uint param_1 = bit;
    uint param_2 = width;
    return packed_element(param, param_1, param_2);
}

static inline __attribute__((always_inline))
float embed_linear(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& scale, const device EmbedStatic& EmbedStatic_1)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = embed_code(param, param_1, param_2, EmbedStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    return as_type<float>(EmbedStatic_1._data[scale]) + (as_type<float>(EmbedStatic_1._data[scale + 1u]) * float(code));
}

static inline __attribute__((always_inline))
float3 embed_linear3(thread const uint& section, thread const uint& index, thread const uint& stride, thread const uint& width, thread const uint& scale, const device EmbedStatic& EmbedStatic_1)
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
    return float3(embed_linear(param, param_1, param_2, param_3, EmbedStatic_1), embed_linear(param_4, param_5, param_6, param_7, EmbedStatic_1), embed_linear(param_8, param_9, param_10, param_11, EmbedStatic_1));
}

static inline __attribute__((always_inline))
float4 mesh_blend(thread const uint& plane, thread const Foot& foot, constant BindSurfaceConstants& constants, const device Mesh& Mesh_1)
{
    uint first = plane * constants.vertices;
    return ((Mesh_1._data[first + foot.vertex0.x] * foot.weight.x) + (Mesh_1._data[first + foot.vertex0.y] * foot.weight.y)) + (Mesh_1._data[first + foot.vertex0.z] * foot.weight.z);
}

static inline __attribute__((always_inline))
Rows3 polar(thread Rows3& m)
{
    for (int _step = 0; _step < 3; _step++)
    {
        float3 c0 = cross(m.row1, m.row2);
        float3 c1 = cross(m.row2, m.row0);
        float3 c2 = cross(m.row0, m.row1);
        float determinant = dot(m.row0, c0);
        m.row0 = (m.row0 + (c0 / float3(determinant))) * 0.5;
        m.row1 = (m.row1 + (c1 / float3(determinant))) * 0.5;
        m.row2 = (m.row2 + (c2 / float3(determinant))) * 0.5;
    }
    return m;
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
float4 surface_turn(thread const uint& triangle_id, thread const Foot& foot, constant BindSurfaceConstants& constants, const device Mesh& Mesh_1, const device Mesh& Triangles)
{
    if (constants.rotation_rule == 2u)
    {
        return Triangles._data[constants.triangles + triangle_id];
    }
    if (constants.rotation_rule == 3u)
    {
        uint param = 2u;
        Foot param_1 = foot;
        Rows3 blended;
        blended.row0 = mesh_blend(param, param_1, constants, Mesh_1).xyz;
        uint param_2 = 3u;
        Foot param_3 = foot;
        blended.row1 = mesh_blend(param_2, param_3, constants, Mesh_1).xyz;
        uint param_4 = 4u;
        Foot param_5 = foot;
        blended.row2 = mesh_blend(param_4, param_5, constants, Mesh_1).xyz;
        Rows3 param_6 = blended;
        Rows3 _1127 = polar(param_6);
        Rows3 param_7 = _1127;
        return quat_from_matrix(param_7);
    }
    uint param_8 = 2u;
    Foot param_9 = foot;
    return mesh_blend(param_8, param_9, constants, Mesh_1);
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
float3 rotate(thread const Rows3& m, thread const float3& v)
{
    return float3(dot(m.row0, v), dot(m.row1, v), dot(m.row2, v));
}

static inline __attribute__((always_inline))
float3 surface_position(thread const uint& row, thread const Foot& foot, thread const float& size, const device EmbedStatic& EmbedStatic_1, constant BindSurfaceConstants& constants, const device Mesh& Mesh_1)
{
    float3 moved;
    if (constants.position_rule == 1u)
    {
        float3 param = Mesh_1._data[foot.vertex0.x].xyz;
        float3 param_1 = Mesh_1._data[foot.vertex0.y].xyz;
        float3 param_2 = Mesh_1._data[foot.vertex0.z].xyz;
        TriangleShape shape = triangle_by_edge(param, param_1, param_2);
        uint param_3 = constants.local_offset;
        uint param_4 = row;
        uint param_5 = constants.count;
        uint param_6 = constants.local_offset_width;
        uint param_7 = constants.local_offset_scale;
        float3 offset = embed_linear3(param_3, param_4, param_5, param_6, param_7, EmbedStatic_1);
        Rows3 param_8 = shape.frame;
        float3 param_9 = offset;
        moved = rotate(param_8, param_9) * size;
    }
    else
    {
        uint param_10 = 1u;
        Foot param_11 = foot;
        float3 normal = mesh_blend(param_10, param_11, constants, Mesh_1).xyz;
        if (constants.position_rule == 0u)
        {
            float3 param_12 = normal;
            normal = bind_unit(param_12);
        }
        uint param_13 = constants.displacement;
        uint param_14 = row;
        uint param_15 = constants.displacement_width;
        uint param_16 = constants.displacement_scale;
        moved = normal * embed_linear(param_13, param_14, param_15, param_16, EmbedStatic_1);
    }
    uint param_17 = 0u;
    Foot param_18 = foot;
    return mesh_blend(param_17, param_18, constants, Mesh_1).xyz + moved;
}

static inline __attribute__((always_inline))
float4 bind_unit4(thread const float4& v)
{
    return v / float4(fast::max(sqrt(dot(v, v)), 1.0000000031710768509710513471353e-30));
}

static inline __attribute__((always_inline))
float4 quat_multiply(thread const float4& a, thread const float4& b)
{
    return float4((((a.x * b.x) - (a.y * b.y)) - (a.z * b.z)) - (a.w * b.w), (((a.x * b.y) + (a.y * b.x)) + (a.z * b.w)) - (a.w * b.z), (((a.x * b.z) - (a.y * b.w)) + (a.z * b.x)) + (a.w * b.y), (((a.x * b.w) + (a.y * b.z)) - (a.z * b.y)) + (a.w * b.x));
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
BoundSplat bind_by_turn(thread const float3& mean, thread const float4& turn, thread const float4& local_quat_wxyz)
{
    float4 param = turn;
    float4 unit_turn = bind_unit4(param);
    BoundSplat b;
    b.mean = mean;
    float4 param_1 = unit_turn;
    float4 param_2 = local_quat_wxyz;
    b.quat_wxyz = quat_multiply(param_1, param_2);
    float4 param_3 = unit_turn;
    b.sh_rotation = matrix_from_quat(param_3);
    return b;
}

static inline __attribute__((always_inline))
Rows3 identity_rows()
{
    Rows3 r;
    r.row0 = float3(1.0, 0.0, 0.0);
    r.row1 = float3(0.0, 1.0, 0.0);
    r.row2 = float3(0.0, 0.0, 1.0);
    return r;
}

static inline __attribute__((always_inline))
float3 transform_point(thread const Rows4& m, thread const float3& p)
{
    return float3((((m.row0.x * p.x) + (m.row0.y * p.y)) + (m.row0.z * p.z)) + m.row0.w, (((m.row1.x * p.x) + (m.row1.y * p.y)) + (m.row1.z * p.z)) + m.row1.w, (((m.row2.x * p.x) + (m.row2.y * p.y)) + (m.row2.z * p.z)) + m.row2.w);
}

static inline __attribute__((always_inline))
Rows3 linear_part(thread const Rows4& m)
{
    Rows3 r;
    r.row0 = m.row0.xyz;
    r.row1 = m.row1.xyz;
    r.row2 = m.row2.xyz;
    return r;
}

static inline __attribute__((always_inline))
float3 rotate_inverse(thread const Rows3& m, thread const float3& v)
{
    return ((m.row0 * v.x) + (m.row1 * v.y)) + (m.row2 * v.z);
}

static inline __attribute__((always_inline))
Rows3 multiply(thread const Rows3& a, thread const Rows3& b)
{
    Rows3 param = b;
    float3 param_1 = a.row0;
    Rows3 r;
    r.row0 = rotate_inverse(param, param_1);
    Rows3 param_2 = b;
    float3 param_3 = a.row1;
    r.row1 = rotate_inverse(param_2, param_3);
    Rows3 param_4 = b;
    float3 param_5 = a.row2;
    r.row2 = rotate_inverse(param_4, param_5);
    return r;
}

static inline __attribute__((always_inline))
BoundSplat bind_place(thread BoundSplat& b, thread const Rows4& world, thread const float4& world_quat_wxyz)
{
    Rows4 param = world;
    float3 param_1 = b.mean;
    b.mean = transform_point(param, param_1);
    float4 param_2 = world_quat_wxyz;
    float4 param_3 = b.quat_wxyz;
    b.quat_wxyz = quat_multiply(param_2, param_3);
    Rows4 param_4 = world;
    Rows3 param_5 = linear_part(param_4);
    Rows3 param_6 = b.sh_rotation;
    b.sh_rotation = multiply(param_5, param_6);
    return b;
}

static inline __attribute__((always_inline))
float3 scale_log_area(thread const float3& log_scale, thread const float& area, thread const float& canonical_area, thread const float& damping, thread const float& log_training_per_bundle)
{
    float ratio = (area + damping) / (canonical_area + damping);
    return ((log_scale + float3(log_training_per_bundle)) * ratio) - float3(log_training_per_bundle);
}

static inline __attribute__((always_inline))
float3 scale_linear(thread const float3& log_scale, thread const float& size, thread const float& canonical_size)
{
    return log_scale + float3(log(fast::max(size, 1.0000000031710768509710513471353e-30) / canonical_size));
}

static inline __attribute__((always_inline))
float3 surface_scale(thread const float3& log_scale, thread const float& size, thread const float& canonical, constant BindSurfaceConstants& constants)
{
    if (constants.scale_rule == 1u)
    {
        float3 param = log_scale;
        float param_1 = size;
        float param_2 = canonical;
        float param_3 = constants.area_damping;
        float param_4 = constants.log_training_per_bundle;
        return scale_log_area(param, param_1, param_2, param_3, param_4);
    }
    if (constants.scale_rule == 2u)
    {
        float3 param_5 = log_scale;
        float param_6 = size;
        float param_7 = canonical;
        return scale_linear(param_5, param_6, param_7);
    }
    return log_scale;
}

static inline __attribute__((always_inline))
void _bind_surface(thread const uint3& id, const device EmbedStatic& EmbedStatic_1, constant BindSurfaceConstants& constants, const device Mesh& Mesh_1, const device Mesh& Triangles, device Splats& Splats_1)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    uint param = constants.triangle_ids;
    uint param_1 = row;
    uint param_2 = constants.triangle_ids_width;
    uint t = embed_code(param, param_1, param_2, EmbedStatic_1);
    float4 rest = Triangles._data[(2u * constants.triangles) + t];
    Foot foot;
    foot.vertex0 = uint3(rest.yzw);
    uint param_3 = constants.barycentric;
    uint param_4 = row;
    uint param_5 = constants.count;
    uint param_6 = constants.barycentric_width;
    uint param_7 = constants.barycentric_scale;
    foot.weight = embed_linear3(param_3, param_4, param_5, param_6, param_7, EmbedStatic_1);
    uint param_8 = t;
    Foot param_9 = foot;
    float4 turn = surface_turn(param_8, param_9, constants, Mesh_1, Triangles);
    float size = ((device float*)&Triangles._data[t])[3u];
    uint param_10 = constants.local_quat;
    uint param_11 = row;
    uint param_12 = constants.local_quat_width;
    uint param_13 = constants.local_quat_scale;
    uint param_14 = constants.local_quat;
    uint param_15 = constants.count + row;
    uint param_16 = constants.count;
    uint param_17 = constants.local_quat_width;
    uint param_18 = constants.local_quat_scale + 2u;
    float4 local_quat_wxyz = float4(embed_linear(param_10, param_11, param_12, param_13, EmbedStatic_1), embed_linear3(param_14, param_15, param_16, param_17, param_18, EmbedStatic_1));
    uint param_19 = row;
    Foot param_20 = foot;
    float param_21 = size;
    float3 param_22 = surface_position(param_19, param_20, param_21, EmbedStatic_1, constants, Mesh_1);
    float4 param_23 = turn;
    float4 param_24 = local_quat_wxyz;
    BoundSplat b = bind_by_turn(param_22, param_23, param_24);
    if (constants.sh_direction == 1u)
    {
        b.sh_rotation = identity_rows();
    }
    Rows4 world;
    world.row0 = constants.world_row0;
    world.row1 = constants.world_row1;
    world.row2 = constants.world_row2;
    BoundSplat param_25 = b;
    Rows4 param_26 = world;
    float4 param_27 = constants.world_quat_wxyz;
    BoundSplat _1415 = bind_place(param_25, param_26, param_27);
    b = _1415;
    float3 log_scale = float3(((device float*)&Splats_1._data[(2u * constants.count) + row])[3u], ((device float*)&Splats_1._data[(3u * constants.count) + row])[3u], ((device float*)&Splats_1._data[(4u * constants.count) + row])[3u]);
    float3 param_28 = log_scale;
    float param_29 = size;
    float param_30 = rest.x;
    log_scale = surface_scale(param_28, param_29, param_30, constants);
    Splats_1._data[row] = float4(b.mean, ((device float*)&Splats_1._data[row])[3u]);
    Splats_1._data[constants.count + row] = b.quat_wxyz;
    Splats_1._data[(2u * constants.count) + row] = float4(b.sh_rotation.row0, log_scale.x);
    Splats_1._data[(3u * constants.count) + row] = float4(b.sh_rotation.row1, log_scale.y);
    Splats_1._data[(4u * constants.count) + row] = float4(b.sh_rotation.row2, log_scale.z);
}

kernel void bind_surface(const device EmbedStatic& EmbedStatic_1 [[buffer(0)]], const device Mesh& Mesh_1 [[buffer(1)]], const device Mesh& Triangles [[buffer(2)]], device Splats& Splats_1 [[buffer(3)]], constant BindSurfaceConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _bind_surface(param, EmbedStatic_1, constants, Mesh_1, Triangles, Splats_1);
}

