#version 310 es
// Generated from hlsl/bind_surface.hlsl, entry bind_surface, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

struct Rows3
{
    vec3 row0;
    vec3 row1;
    vec3 row2;
};

struct Rows4
{
    vec4 row0;
    vec4 row1;
    vec4 row2;
};

struct BoundSplat
{
    vec3 mean;
    vec4 quat_wxyz;
    Rows3 sh_rotation;
};

struct TriangleShape
{
    Rows3 frame;
    float size;
    vec3 across;
};

layout(binding = 0, std430) readonly buffer EmbedStatic
{
    uint _data[];
} EmbedStatic_1;

layout(binding = 8, std140) uniform BindSurfaceConstants
{
    uint count;
    uint vertices;
    uint triangles;
    uint triangle_ids;
    uint vertex_ids;
    uint barycentric;
    uint displacement;
    uint local_offset;
    uint local_quat;
    uint canonical_size;
    uint position_rule;
    uint rotation_rule;
    uint scale_rule;
    uint sh_direction;
    float area_damping;
    float log_training_per_bundle;
    vec4 world_row0;
    vec4 world_row1;
    vec4 world_row2;
    vec4 world_quat_wxyz;
} constants;

layout(binding = 1, std430) readonly buffer Mesh
{
    vec4 _data[];
} Mesh_1;

layout(binding = 2, std430) readonly buffer Triangles
{
    vec4 _data[];
} Triangles_1;

layout(binding = 3, std430) buffer Splats
{
    vec4 _data[];
} Splats_1;

float embed_value(uint section, uint plane, uint row)
{
    return uintBitsToFloat(EmbedStatic_1._data[(section + (plane * constants.count)) + row]);
}

uint embed_vertex(uint corner, uint row)
{
    return EmbedStatic_1._data[(constants.vertex_ids + (corner * constants.count)) + row];
}

vec4 mesh_blend(uint plane, uint row, vec3 weight)
{
    uint first = plane * constants.vertices;
    uint param = 0u;
    uint param_1 = row;
    uint param_2 = 1u;
    uint param_3 = row;
    uint param_4 = 2u;
    uint param_5 = row;
    return ((Mesh_1._data[first + embed_vertex(param, param_1)] * weight.x) + (Mesh_1._data[first + embed_vertex(param_2, param_3)] * weight.y)) + (Mesh_1._data[first + embed_vertex(param_4, param_5)] * weight.z);
}

Rows3 polar(inout Rows3 m)
{
    for (int _step = 0; _step < 3; _step++)
    {
        vec3 c0 = cross(m.row1, m.row2);
        vec3 c1 = cross(m.row2, m.row0);
        vec3 c2 = cross(m.row0, m.row1);
        float determinant = dot(m.row0, c0);
        m.row0 = (m.row0 + (c0 / vec3(determinant))) * 0.5;
        m.row1 = (m.row1 + (c1 / vec3(determinant))) * 0.5;
        m.row2 = (m.row2 + (c2 / vec3(determinant))) * 0.5;
    }
    return m;
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

vec4 surface_turn(uint row, uint triangle_id, vec3 weight)
{
    if (constants.rotation_rule == 2u)
    {
        return Triangles_1._data[constants.triangles + triangle_id];
    }
    if (constants.rotation_rule == 3u)
    {
        uint param = 2u;
        uint param_1 = row;
        vec3 param_2 = weight;
        Rows3 blended;
        blended.row0 = mesh_blend(param, param_1, param_2).xyz;
        uint param_3 = 3u;
        uint param_4 = row;
        vec3 param_5 = weight;
        blended.row1 = mesh_blend(param_3, param_4, param_5).xyz;
        uint param_6 = 4u;
        uint param_7 = row;
        vec3 param_8 = weight;
        blended.row2 = mesh_blend(param_6, param_7, param_8).xyz;
        Rows3 param_9 = blended;
        Rows3 _1044 = polar(param_9);
        Rows3 param_10 = _1044;
        return quat_from_matrix(param_10);
    }
    uint param_11 = 2u;
    uint param_12 = row;
    vec3 param_13 = weight;
    return mesh_blend(param_11, param_12, param_13);
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

vec3 rotate(Rows3 m, vec3 v)
{
    return vec3(dot(m.row0, v), dot(m.row1, v), dot(m.row2, v));
}

vec3 surface_position(uint row, vec3 foot, vec3 weight, float size)
{
    if (constants.position_rule == 1u)
    {
        uint param = 0u;
        uint param_1 = row;
        uint v0 = embed_vertex(param, param_1);
        uint param_2 = 1u;
        uint param_3 = row;
        uint v1 = embed_vertex(param_2, param_3);
        uint param_4 = 2u;
        uint param_5 = row;
        uint v2 = embed_vertex(param_4, param_5);
        vec3 param_6 = Mesh_1._data[v0].xyz;
        vec3 param_7 = Mesh_1._data[v1].xyz;
        vec3 param_8 = Mesh_1._data[v2].xyz;
        TriangleShape shape = triangle_by_edge(param_6, param_7, param_8);
        uint param_9 = constants.local_offset;
        uint param_10 = 0u;
        uint param_11 = row;
        uint param_12 = constants.local_offset;
        uint param_13 = 1u;
        uint param_14 = row;
        uint param_15 = constants.local_offset;
        uint param_16 = 2u;
        uint param_17 = row;
        vec3 offset = vec3(embed_value(param_9, param_10, param_11), embed_value(param_12, param_13, param_14), embed_value(param_15, param_16, param_17));
        Rows3 param_18 = shape.frame;
        vec3 param_19 = offset;
        return foot + (rotate(param_18, param_19) * size);
    }
    uint param_20 = 1u;
    uint param_21 = row;
    vec3 param_22 = weight;
    vec3 normal = mesh_blend(param_20, param_21, param_22).xyz;
    if (constants.position_rule == 0u)
    {
        vec3 param_23 = normal;
        normal = bind_unit(param_23);
    }
    uint param_24 = constants.displacement;
    uint param_25 = 0u;
    uint param_26 = row;
    return foot + (normal * embed_value(param_24, param_25, param_26));
}

vec4 bind_unit4(vec4 v)
{
    return v / vec4(max(sqrt(dot(v, v)), 1.0000000031710768509710513471353e-30));
}

vec4 quat_multiply(vec4 a, vec4 b)
{
    return vec4((((a.x * b.x) - (a.y * b.y)) - (a.z * b.z)) - (a.w * b.w), (((a.x * b.y) + (a.y * b.x)) + (a.z * b.w)) - (a.w * b.z), (((a.x * b.z) - (a.y * b.w)) + (a.z * b.x)) + (a.w * b.y), (((a.x * b.w) + (a.y * b.z)) - (a.z * b.y)) + (a.w * b.x));
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

BoundSplat bind_by_turn(vec3 mean, vec4 turn, vec4 local_quat_wxyz)
{
    vec4 param = turn;
    vec4 unit_turn = bind_unit4(param);
    BoundSplat b;
    b.mean = mean;
    vec4 param_1 = unit_turn;
    vec4 param_2 = local_quat_wxyz;
    b.quat_wxyz = quat_multiply(param_1, param_2);
    vec4 param_3 = unit_turn;
    b.sh_rotation = matrix_from_quat(param_3);
    return b;
}

Rows3 identity_rows()
{
    Rows3 r;
    r.row0 = vec3(1.0, 0.0, 0.0);
    r.row1 = vec3(0.0, 1.0, 0.0);
    r.row2 = vec3(0.0, 0.0, 1.0);
    return r;
}

vec3 transform_point(Rows4 m, vec3 p)
{
    return vec3((((m.row0.x * p.x) + (m.row0.y * p.y)) + (m.row0.z * p.z)) + m.row0.w, (((m.row1.x * p.x) + (m.row1.y * p.y)) + (m.row1.z * p.z)) + m.row1.w, (((m.row2.x * p.x) + (m.row2.y * p.y)) + (m.row2.z * p.z)) + m.row2.w);
}

Rows3 linear_part(Rows4 m)
{
    Rows3 r;
    r.row0 = m.row0.xyz;
    r.row1 = m.row1.xyz;
    r.row2 = m.row2.xyz;
    return r;
}

vec3 rotate_inverse(Rows3 m, vec3 v)
{
    return ((m.row0 * v.x) + (m.row1 * v.y)) + (m.row2 * v.z);
}

Rows3 multiply(Rows3 a, Rows3 b)
{
    Rows3 param = b;
    vec3 param_1 = a.row0;
    Rows3 r;
    r.row0 = rotate_inverse(param, param_1);
    Rows3 param_2 = b;
    vec3 param_3 = a.row1;
    r.row1 = rotate_inverse(param_2, param_3);
    Rows3 param_4 = b;
    vec3 param_5 = a.row2;
    r.row2 = rotate_inverse(param_4, param_5);
    return r;
}

BoundSplat bind_place(inout BoundSplat b, Rows4 world, vec4 world_quat_wxyz)
{
    Rows4 param = world;
    vec3 param_1 = b.mean;
    b.mean = transform_point(param, param_1);
    vec4 param_2 = world_quat_wxyz;
    vec4 param_3 = b.quat_wxyz;
    b.quat_wxyz = quat_multiply(param_2, param_3);
    Rows4 param_4 = world;
    Rows3 param_5 = linear_part(param_4);
    Rows3 param_6 = b.sh_rotation;
    b.sh_rotation = multiply(param_5, param_6);
    return b;
}

vec3 scale_log_area(vec3 log_scale, float area, float canonical_area, float damping, float log_training_per_bundle)
{
    float ratio = (area + damping) / (canonical_area + damping);
    return ((log_scale + vec3(log_training_per_bundle)) * ratio) - vec3(log_training_per_bundle);
}

vec3 scale_linear(vec3 log_scale, float size, float canonical_size)
{
    return log_scale + vec3(log(max(size, 1.0000000031710768509710513471353e-30) / canonical_size));
}

vec3 surface_scale(vec3 log_scale, float size, float canonical)
{
    if (constants.scale_rule == 1u)
    {
        vec3 param = log_scale;
        float param_1 = size;
        float param_2 = canonical;
        float param_3 = constants.area_damping;
        float param_4 = constants.log_training_per_bundle;
        return scale_log_area(param, param_1, param_2, param_3, param_4);
    }
    if (constants.scale_rule == 2u)
    {
        vec3 param_5 = log_scale;
        float param_6 = size;
        float param_7 = canonical;
        return scale_linear(param_5, param_6, param_7);
    }
    return log_scale;
}

void _bind_surface(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    uint t = EmbedStatic_1._data[constants.triangle_ids + row];
    uint param = constants.barycentric;
    uint param_1 = 0u;
    uint param_2 = row;
    uint param_3 = constants.barycentric;
    uint param_4 = 1u;
    uint param_5 = row;
    uint param_6 = constants.barycentric;
    uint param_7 = 2u;
    uint param_8 = row;
    vec3 weight = vec3(embed_value(param, param_1, param_2), embed_value(param_3, param_4, param_5), embed_value(param_6, param_7, param_8));
    uint param_9 = 0u;
    uint param_10 = row;
    vec3 param_11 = weight;
    vec3 foot = mesh_blend(param_9, param_10, param_11).xyz;
    uint param_12 = row;
    uint param_13 = t;
    vec3 param_14 = weight;
    vec4 turn = surface_turn(param_12, param_13, param_14);
    float size = Triangles_1._data[t].w;
    uint param_15 = constants.local_quat;
    uint param_16 = 0u;
    uint param_17 = row;
    uint param_18 = constants.local_quat;
    uint param_19 = 1u;
    uint param_20 = row;
    uint param_21 = constants.local_quat;
    uint param_22 = 2u;
    uint param_23 = row;
    uint param_24 = constants.local_quat;
    uint param_25 = 3u;
    uint param_26 = row;
    vec4 local_quat_wxyz = vec4(embed_value(param_15, param_16, param_17), embed_value(param_18, param_19, param_20), embed_value(param_21, param_22, param_23), embed_value(param_24, param_25, param_26));
    uint param_27 = row;
    vec3 param_28 = foot;
    vec3 param_29 = weight;
    float param_30 = size;
    vec3 param_31 = surface_position(param_27, param_28, param_29, param_30);
    vec4 param_32 = turn;
    vec4 param_33 = local_quat_wxyz;
    BoundSplat b = bind_by_turn(param_31, param_32, param_33);
    if (constants.sh_direction == 1u)
    {
        b.sh_rotation = identity_rows();
    }
    Rows4 world;
    world.row0 = constants.world_row0;
    world.row1 = constants.world_row1;
    world.row2 = constants.world_row2;
    BoundSplat param_34 = b;
    Rows4 param_35 = world;
    vec4 param_36 = constants.world_quat_wxyz;
    BoundSplat _1335 = bind_place(param_34, param_35, param_36);
    b = _1335;
    vec3 log_scale = vec3(Splats_1._data[(2u * constants.count) + row].w, Splats_1._data[(3u * constants.count) + row].w, Splats_1._data[(4u * constants.count) + row].w);
    uint param_37 = constants.canonical_size;
    uint param_38 = 0u;
    uint param_39 = row;
    vec3 param_40 = log_scale;
    float param_41 = size;
    float param_42 = embed_value(param_37, param_38, param_39);
    log_scale = surface_scale(param_40, param_41, param_42);
    Splats_1._data[row] = vec4(b.mean, Splats_1._data[row].w);
    Splats_1._data[constants.count + row] = b.quat_wxyz;
    Splats_1._data[(2u * constants.count) + row] = vec4(b.sh_rotation.row0, log_scale.x);
    Splats_1._data[(3u * constants.count) + row] = vec4(b.sh_rotation.row1, log_scale.y);
    Splats_1._data[(4u * constants.count) + row] = vec4(b.sh_rotation.row2, log_scale.z);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _bind_surface(param);
}

