#version 310 es
// Generated from hlsl/bind_skin.hlsl, entry bind_skin, by `python -m avatar_shaders`; do not edit.
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

layout(binding = 0, std430) readonly buffer BindStatic
{
    uint _data[];
} BindStatic_1;

layout(binding = 8, std140) uniform BindSkinConstants
{
    uint count;
    uint first;
    uint rows;
    uint corrective_ptr;
    uint corrective_column;
    uint corrective_column_width;
    uint corrective_mean;
    uint corrective_mean_width;
    uint corrective_mean_step;
    uint late_ptr;
    uint late_column;
    uint late_column_width;
    uint late_mean;
    uint late_mean_width;
    uint late_mean_step;
    uint skin_ptr;
    uint skin_column;
    uint skin_column_width;
    uint skin_weight;
    uint skin_weight_width;
    uint skin_weight_step;
    uint features;
    uint late;
    uint joints;
    uint binding_rule;
    uint rotation_rule;
    uint sh_direction;
    uint unused;
    vec4 group_matrix_row0;
    vec4 group_matrix_row1;
    vec4 group_matrix_row2;
    vec4 group_rotation_row0;
    vec4 group_rotation_row1;
    vec4 group_rotation_row2;
    vec4 world_row0;
    vec4 world_row1;
    vec4 world_row2;
    vec4 world_quat_wxyz;
} constants;

layout(binding = 1, std430) readonly buffer Pose
{
    float _data[];
} Pose_1;

layout(binding = 2, std430) buffer Splats
{
    vec4 _data[];
} Splats_1;

Rows4 skin_none()
{
    Rows4 sum;
    sum.row0 = vec4(0.0);
    sum.row1 = vec4(0.0);
    sum.row2 = vec4(0.0);
    return sum;
}

uint packed_element(uint word, uint bit, uint width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

uint bind_code(uint section, uint index, uint width)
{
    if (width == 32u)
    {
        return BindStatic_1._data[section + index];
    }
    uint bit = index * width;
    uint param = BindStatic_1._data[section + (bit >> uint(5))];
    uint param_1 = bit;
    uint param_2 = width;
    return packed_element(param, param_1, param_2);
}

float bind_weight(uint section, uint index, uint width, uint _step)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = bind_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    return uintBitsToFloat(BindStatic_1._data[_step]) * float(code);
}

Rows4 skin_add(inout Rows4 sum, float weight, Rows4 joint)
{
    sum.row0 += (joint.row0 * weight);
    sum.row1 += (joint.row1 * weight);
    sum.row2 += (joint.row2 * weight);
    return sum;
}

Rows4 bind_skin_matrix(uint row)
{
    Rows4 blended = skin_none();
    uint end = BindStatic_1._data[(constants.skin_ptr + row) + 1u];
    uint _1022 = constants.skin_ptr + row;
    Rows4 m;
    for (uint e = BindStatic_1._data[_1022]; e < end; e++)
    {
        uint param = constants.skin_column;
        uint param_1 = e;
        uint param_2 = constants.skin_column_width;
        uint at = constants.joints + (12u * bind_code(param, param_1, param_2));
        m.row0 = vec4(Pose_1._data[at], Pose_1._data[at + 1u], Pose_1._data[at + 2u], Pose_1._data[at + 3u]);
        m.row1 = vec4(Pose_1._data[at + 4u], Pose_1._data[at + 5u], Pose_1._data[at + 6u], Pose_1._data[at + 7u]);
        m.row2 = vec4(Pose_1._data[at + 8u], Pose_1._data[at + 9u], Pose_1._data[at + 10u], Pose_1._data[at + 11u]);
        uint param_3 = constants.skin_weight;
        uint param_4 = e;
        uint param_5 = constants.skin_weight_width;
        uint param_6 = constants.skin_weight_step;
        Rows4 param_7 = blended;
        float param_8 = bind_weight(param_3, param_4, param_5, param_6);
        Rows4 param_9 = m;
        Rows4 _1133 = skin_add(param_7, param_8, param_9);
        blended = _1133;
    }
    return blended;
}

Rows3 linear_part(Rows4 m)
{
    Rows3 r;
    r.row0 = m.row0.xyz;
    r.row1 = m.row1.xyz;
    r.row2 = m.row2.xyz;
    return r;
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

float packed_step_count(uint code, uint width)
{
    return float(code) - float(1u << (width - 1u));
}

float bind_signed(uint section, uint index, uint width, uint _step)
{
    if (width == 0u)
    {
        return 0.0;
    }
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = bind_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    uint param_3 = code;
    uint param_4 = width;
    return uintBitsToFloat(BindStatic_1._data[_step]) * packed_step_count(param_3, param_4);
}

vec3 bind_signed3(uint section, uint index, uint width, uint _step)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint param_3 = _step;
    uint param_4 = section;
    uint param_5 = index + 1u;
    uint param_6 = width;
    uint param_7 = _step + 1u;
    uint param_8 = section;
    uint param_9 = index + 2u;
    uint param_10 = width;
    uint param_11 = _step + 2u;
    return vec3(bind_signed(param, param_1, param_2, param_3), bind_signed(param_4, param_5, param_6, param_7), bind_signed(param_8, param_9, param_10, param_11));
}

vec3 bind_corrected(inout vec3 mean, uint row)
{
    uint end = BindStatic_1._data[(constants.corrective_ptr + row) + 1u];
    uint _868 = constants.corrective_ptr + row;
    for (uint e = BindStatic_1._data[_868]; e < end; e++)
    {
        uint param = constants.corrective_column;
        uint param_1 = e;
        uint param_2 = constants.corrective_column_width;
        uint column = bind_code(param, param_1, param_2);
        uint _step = constants.corrective_mean_step + (3u * column);
        uint param_3 = constants.corrective_mean;
        uint param_4 = 3u * e;
        uint param_5 = constants.corrective_mean_width;
        uint param_6 = _step;
        mean += (bind_signed3(param_3, param_4, param_5, param_6) * Pose_1._data[constants.features + column]);
    }
    return mean;
}

vec3 late_add(vec3 posed, float weight, vec3 delta)
{
    return posed + (delta * weight);
}

vec3 bind_late(uint row)
{
    vec3 sum = vec3(0.0);
    uint end = BindStatic_1._data[(constants.late_ptr + row) + 1u];
    uint _946 = constants.late_ptr + row;
    for (uint e = BindStatic_1._data[_946]; e < end; e++)
    {
        uint param = constants.late_column;
        uint param_1 = e;
        uint param_2 = constants.late_column_width;
        uint column = bind_code(param, param_1, param_2);
        uint param_3 = constants.late_mean;
        uint param_4 = 3u * e;
        uint param_5 = constants.late_mean_width;
        uint param_6 = constants.late_mean_step + (3u * column);
        vec3 delta = bind_signed3(param_3, param_4, param_5, param_6);
        vec3 param_7 = sum;
        float param_8 = Pose_1._data[constants.late + column];
        vec3 param_9 = delta;
        sum = late_add(param_7, param_8, param_9);
    }
    return sum;
}

vec3 transform_point(Rows4 m, vec3 p)
{
    return vec3((((m.row0.x * p.x) + (m.row0.y * p.y)) + (m.row0.z * p.z)) + m.row0.w, (((m.row1.x * p.x) + (m.row1.y * p.y)) + (m.row1.z * p.z)) + m.row1.w, (((m.row2.x * p.x) + (m.row2.y * p.y)) + (m.row2.z * p.z)) + m.row2.w);
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

vec4 quat_multiply(vec4 a, vec4 b)
{
    return vec4((((a.x * b.x) - (a.y * b.y)) - (a.z * b.z)) - (a.w * b.w), (((a.x * b.y) + (a.y * b.x)) + (a.z * b.w)) - (a.w * b.z), (((a.x * b.z) - (a.y * b.w)) + (a.z * b.x)) + (a.w * b.y), (((a.x * b.w) + (a.y * b.z)) - (a.z * b.y)) + (a.w * b.x));
}

BoundSplat bind_by_matrix(Rows4 transform, Rows3 rotation, vec3 mean, vec3 late, vec4 quat_wxyz)
{
    Rows4 param = transform;
    vec3 param_1 = mean;
    BoundSplat b;
    b.mean = transform_point(param, param_1) + late;
    Rows3 param_2 = rotation;
    vec4 param_3 = quat_from_matrix(param_2);
    vec4 param_4 = quat_wxyz;
    b.quat_wxyz = quat_multiply(param_3, param_4);
    b.sh_rotation = rotation;
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

void _bind_skin(uvec3 id)
{
    if (id.x >= constants.rows)
    {
        return;
    }
    uint row = constants.first + id.x;
    Rows4 transform;
    transform.row0 = constants.group_matrix_row0;
    transform.row1 = constants.group_matrix_row1;
    transform.row2 = constants.group_matrix_row2;
    Rows3 rotation;
    rotation.row0 = constants.group_rotation_row0.xyz;
    rotation.row1 = constants.group_rotation_row1.xyz;
    rotation.row2 = constants.group_rotation_row2.xyz;
    if (constants.binding_rule == 1u)
    {
        uint param = row;
        transform = bind_skin_matrix(param);
        if (constants.rotation_rule == 4u)
        {
            Rows4 param_1 = transform;
            Rows3 param_2 = linear_part(param_1);
            Rows3 _1202 = polar(param_2);
            rotation = _1202;
        }
    }
    Rows4 world;
    world.row0 = constants.world_row0;
    world.row1 = constants.world_row1;
    world.row2 = constants.world_row2;
    vec4 mean = Splats_1._data[row];
    vec3 param_3 = mean.xyz;
    uint param_4 = row;
    vec3 _1230 = bind_corrected(param_3, param_4);
    uint param_5 = row;
    Rows4 param_6 = transform;
    Rows3 param_7 = rotation;
    vec3 param_8 = _1230;
    vec3 param_9 = bind_late(param_5);
    vec4 param_10 = Splats_1._data[constants.count + row];
    BoundSplat b = bind_by_matrix(param_6, param_7, param_8, param_9, param_10);
    if (constants.sh_direction == 1u)
    {
        b.sh_rotation = identity_rows();
    }
    BoundSplat param_11 = b;
    Rows4 param_12 = world;
    vec4 param_13 = constants.world_quat_wxyz;
    BoundSplat _1264 = bind_place(param_11, param_12, param_13);
    b = _1264;
    Splats_1._data[row] = vec4(b.mean, mean.w);
    Splats_1._data[constants.count + row] = b.quat_wxyz;
    Splats_1._data[(2u * constants.count) + row] = vec4(b.sh_rotation.row0, Splats_1._data[(2u * constants.count) + row].w);
    Splats_1._data[(3u * constants.count) + row] = vec4(b.sh_rotation.row1, Splats_1._data[(3u * constants.count) + row].w);
    Splats_1._data[(4u * constants.count) + row] = vec4(b.sh_rotation.row2, Splats_1._data[(4u * constants.count) + row].w);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _bind_skin(param);
}

