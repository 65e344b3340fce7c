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

struct Foot
{
    uvec3 vertex;
    vec3 weight;
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

uint packed_element(uint word, uint bit, uint width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

uint embed_code(uint section, uint index, uint width)
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

float embed_linear(uint section, uint index, uint width, uint scale)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = embed_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    return uintBitsToFloat(EmbedStatic_1._data[scale]) + (uintBitsToFloat(EmbedStatic_1._data[scale + 1u]) * float(code));
}

vec3 embed_linear3(uint section, uint index, uint stride, uint width, uint scale)
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
    return vec3(embed_linear(param, param_1, param_2, param_3), embed_linear(param_4, param_5, param_6, param_7), embed_linear(param_8, param_9, param_10, param_11));
}

vec4 mesh_blend(uint plane, Foot foot)
{
    uint first = plane * constants.vertices;
    return ((Mesh_1._data[first + foot.vertex.x] * foot.weight.x) + (Mesh_1._data[first + foot.vertex.y] * foot.weight.y)) + (Mesh_1._data[first + foot.vertex.z] * foot.weight.z);
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

vec4 surface_turn(uint triangle_id, Foot foot)
{
    if (constants.rotation_rule == 2u)
    {
        return Triangles_1._data[constants.triangles + triangle_id];
    }
    if (constants.rotation_rule == 3u)
    {
        uint param = 2u;
        Foot param_1 = foot;
        Rows3 blended;
        blended.row0 = mesh_blend(param, param_1).xyz;
        uint param_2 = 3u;
        Foot param_3 = foot;
        blended.row1 = mesh_blend(param_2, param_3).xyz;
        uint param_4 = 4u;
        Foot param_5 = foot;
        blended.row2 = mesh_blend(param_4, param_5).xyz;
        Rows3 param_6 = blended;
        Rows3 _1127 = polar(param_6);
        Rows3 param_7 = _1127;
        return quat_from_matrix(param_7);
    }
    uint param_8 = 2u;
    Foot param_9 = foot;
    return mesh_blend(param_8, param_9);
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

vec3 surface_position(uint row, Foot foot, float size)
{
    vec3 moved;
    if (constants.position_rule == 1u)
    {
        vec3 param = Mesh_1._data[foot.vertex.x].xyz;
        vec3 param_1 = Mesh_1._data[foot.vertex.y].xyz;
        vec3 param_2 = Mesh_1._data[foot.vertex.z].xyz;
        TriangleShape shape = triangle_by_edge(param, param_1, param_2);
        uint param_3 = constants.local_offset;
        uint param_4 = row;
        uint param_5 = constants.count;
        uint param_6 = constants.local_offset_width;
        uint param_7 = constants.local_offset_scale;
        vec3 offset = embed_linear3(param_3, param_4, param_5, param_6, param_7);
        Rows3 param_8 = shape.frame;
        vec3 param_9 = offset;
        moved = rotate(param_8, param_9) * size;
    }
    else
    {
        uint param_10 = 1u;
        Foot param_11 = foot;
        vec3 normal = mesh_blend(param_10, param_11).xyz;
        if (constants.position_rule == 0u)
        {
            vec3 param_12 = normal;
            normal = bind_unit(param_12);
        }
        uint param_13 = constants.displacement;
        uint param_14 = row;
        uint param_15 = constants.displacement_width;
        uint param_16 = constants.displacement_scale;
        moved = normal * embed_linear(param_13, param_14, param_15, param_16);
    }
    uint param_17 = 0u;
    Foot param_18 = foot;
    return mesh_blend(param_17, param_18).xyz + moved;
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
    uint param = constants.triangle_ids;
    uint param_1 = row;
    uint param_2 = constants.triangle_ids_width;
    uint t = embed_code(param, param_1, param_2);
    vec4 rest = Triangles_1._data[(2u * constants.triangles) + t];
    Foot foot;
    foot.vertex = uvec3(rest.yzw);
    uint param_3 = constants.barycentric;
    uint param_4 = row;
    uint param_5 = constants.count;
    uint param_6 = constants.barycentric_width;
    uint param_7 = constants.barycentric_scale;
    foot.weight = embed_linear3(param_3, param_4, param_5, param_6, param_7);
    uint param_8 = t;
    Foot param_9 = foot;
    vec4 turn = surface_turn(param_8, param_9);
    float size = Triangles_1._data[t].w;
    uint param_10 = constants.local_quat;
    uint param_11 = row;
    uint param_12 = constants.local_quat_width;
    uint param_13 = constants.local_quat_scale;
    uint param_14 = constants.local_quat;
    uint param_15 = constants.count + row;
    uint param_16 = constants.count;
    uint param_17 = constants.local_quat_width;
    uint param_18 = constants.local_quat_scale + 2u;
    vec4 local_quat_wxyz = vec4(embed_linear(param_10, param_11, param_12, param_13), embed_linear3(param_14, param_15, param_16, param_17, param_18));
    uint param_19 = row;
    Foot param_20 = foot;
    float param_21 = size;
    vec3 param_22 = surface_position(param_19, param_20, param_21);
    vec4 param_23 = turn;
    vec4 param_24 = local_quat_wxyz;
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
    vec4 param_27 = constants.world_quat_wxyz;
    BoundSplat _1415 = bind_place(param_25, param_26, param_27);
    b = _1415;
    vec3 log_scale = vec3(Splats_1._data[(2u * constants.count) + row].w, Splats_1._data[(3u * constants.count) + row].w, Splats_1._data[(4u * constants.count) + row].w);
    vec3 param_28 = log_scale;
    float param_29 = size;
    float param_30 = rest.x;
    log_scale = surface_scale(param_28, param_29, param_30);
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

