// Generated from hlsl/bind_skin.hlsl, entry bind_skin, by `python -m avatar_shaders`; do not edit.
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

struct BindStatic
{
    uint _data[1];
};

struct BindSkinConstants
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
    float4 group_matrix_row0;
    float4 group_matrix_row1;
    float4 group_matrix_row2;
    float4 group_rotation_row0;
    float4 group_rotation_row1;
    float4 group_rotation_row2;
    float4 world_row0;
    float4 world_row1;
    float4 world_row2;
    float4 world_quat_wxyz;
};

struct Pose
{
    float _data[1];
};

struct Splats
{
    float4 _data[1];
};

static inline __attribute__((always_inline))
Rows4 skin_none()
{
    Rows4 sum;
    sum.row0 = float4(0.0);
    sum.row1 = float4(0.0);
    sum.row2 = float4(0.0);
    return sum;
}

static inline __attribute__((always_inline))
uint packed_element(thread const uint& word, thread const uint& bit, thread const uint& width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

static inline __attribute__((always_inline))
uint bind_code(thread const uint& section, thread const uint& index, thread const uint& width, const device BindStatic& BindStatic_1)
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

static inline __attribute__((always_inline))
float bind_weight(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& _step, const device BindStatic& BindStatic_1)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = bind_code(param, param_1, param_2, BindStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    return as_type<float>(BindStatic_1._data[_step]) * float(code);
}

static inline __attribute__((always_inline))
Rows4 skin_add(thread Rows4& sum, thread const float& weight, thread const Rows4& joint)
{
    sum.row0 += (joint.row0 * weight);
    sum.row1 += (joint.row1 * weight);
    sum.row2 += (joint.row2 * weight);
    return sum;
}

static inline __attribute__((always_inline))
Rows4 bind_skin_matrix(thread const uint& row, const device BindStatic& BindStatic_1, constant BindSkinConstants& constants, const device Pose& Pose_1)
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
        uint at = constants.joints + (12u * bind_code(param, param_1, param_2, BindStatic_1));
        m.row0 = float4(Pose_1._data[at], Pose_1._data[at + 1u], Pose_1._data[at + 2u], Pose_1._data[at + 3u]);
        m.row1 = float4(Pose_1._data[at + 4u], Pose_1._data[at + 5u], Pose_1._data[at + 6u], Pose_1._data[at + 7u]);
        m.row2 = float4(Pose_1._data[at + 8u], Pose_1._data[at + 9u], Pose_1._data[at + 10u], Pose_1._data[at + 11u]);
        uint param_3 = constants.skin_weight;
        uint param_4 = e;
        uint param_5 = constants.skin_weight_width;
        uint param_6 = constants.skin_weight_step;
        Rows4 param_7 = blended;
        float param_8 = bind_weight(param_3, param_4, param_5, param_6, BindStatic_1);
        Rows4 param_9 = m;
        Rows4 _1133 = skin_add(param_7, param_8, param_9);
        blended = _1133;
    }
    return blended;
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
float packed_step_count(thread const uint& code, thread const uint& width)
{
    return float(code) - float(1u << (width - 1u));
}

static inline __attribute__((always_inline))
float bind_signed(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& _step, const device BindStatic& BindStatic_1)
{
    if (width == 0u)
    {
        return 0.0;
    }
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = bind_code(param, param_1, param_2, BindStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    uint param_3 = code;
    uint param_4 = width;
    return as_type<float>(BindStatic_1._data[_step]) * packed_step_count(param_3, param_4);
}

static inline __attribute__((always_inline))
float3 bind_signed3(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& _step, const device BindStatic& BindStatic_1)
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
    return float3(bind_signed(param, param_1, param_2, param_3, BindStatic_1), bind_signed(param_4, param_5, param_6, param_7, BindStatic_1), bind_signed(param_8, param_9, param_10, param_11, BindStatic_1));
}

static inline __attribute__((always_inline))
float3 bind_corrected(thread float3& mean, thread const uint& row, const device BindStatic& BindStatic_1, constant BindSkinConstants& constants, const device Pose& Pose_1)
{
    uint end = BindStatic_1._data[(constants.corrective_ptr + row) + 1u];
    uint _868 = constants.corrective_ptr + row;
    for (uint e = BindStatic_1._data[_868]; e < end; e++)
    {
        uint param = constants.corrective_column;
        uint param_1 = e;
        uint param_2 = constants.corrective_column_width;
        uint column = bind_code(param, param_1, param_2, BindStatic_1);
        uint _step = constants.corrective_mean_step + (3u * column);
        uint param_3 = constants.corrective_mean;
        uint param_4 = 3u * e;
        uint param_5 = constants.corrective_mean_width;
        uint param_6 = _step;
        mean += (bind_signed3(param_3, param_4, param_5, param_6, BindStatic_1) * Pose_1._data[constants.features + column]);
    }
    return mean;
}

static inline __attribute__((always_inline))
float3 late_add(thread const float3& posed, thread const float& weight, thread const float3& delta)
{
    return posed + (delta * weight);
}

static inline __attribute__((always_inline))
float3 bind_late(thread const uint& row, const device BindStatic& BindStatic_1, constant BindSkinConstants& constants, const device Pose& Pose_1)
{
    float3 sum = float3(0.0);
    uint end = BindStatic_1._data[(constants.late_ptr + row) + 1u];
    uint _946 = constants.late_ptr + row;
    for (uint e = BindStatic_1._data[_946]; e < end; e++)
    {
        uint param = constants.late_column;
        uint param_1 = e;
        uint param_2 = constants.late_column_width;
        uint column = bind_code(param, param_1, param_2, BindStatic_1);
        uint param_3 = constants.late_mean;
        uint param_4 = 3u * e;
        uint param_5 = constants.late_mean_width;
        uint param_6 = constants.late_mean_step + (3u * column);
        float3 delta = bind_signed3(param_3, param_4, param_5, param_6, BindStatic_1);
        float3 param_7 = sum;
        float param_8 = Pose_1._data[constants.late + column];
        float3 param_9 = delta;
        sum = late_add(param_7, param_8, param_9);
    }
    return sum;
}

static inline __attribute__((always_inline))
float3 transform_point(thread const Rows4& m, thread const float3& p)
{
    return float3((((m.row0.x * p.x) + (m.row0.y * p.y)) + (m.row0.z * p.z)) + m.row0.w, (((m.row1.x * p.x) + (m.row1.y * p.y)) + (m.row1.z * p.z)) + m.row1.w, (((m.row2.x * p.x) + (m.row2.y * p.y)) + (m.row2.z * p.z)) + m.row2.w);
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
float4 quat_multiply(thread const float4& a, thread const float4& b)
{
    return float4((((a.x * b.x) - (a.y * b.y)) - (a.z * b.z)) - (a.w * b.w), (((a.x * b.y) + (a.y * b.x)) + (a.z * b.w)) - (a.w * b.z), (((a.x * b.z) - (a.y * b.w)) + (a.z * b.x)) + (a.w * b.y), (((a.x * b.w) + (a.y * b.z)) - (a.z * b.y)) + (a.w * b.x));
}

static inline __attribute__((always_inline))
BoundSplat bind_by_matrix(thread const Rows4& transform, thread const Rows3& rotation, thread const float3& mean, thread const float3& late, thread const float4& quat_wxyz)
{
    Rows4 param = transform;
    float3 param_1 = mean;
    BoundSplat b;
    b.mean = transform_point(param, param_1) + late;
    Rows3 param_2 = rotation;
    float4 param_3 = quat_from_matrix(param_2);
    float4 param_4 = quat_wxyz;
    b.quat_wxyz = quat_multiply(param_3, param_4);
    b.sh_rotation = rotation;
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
void _bind_skin(thread const uint3& id, const device BindStatic& BindStatic_1, constant BindSkinConstants& constants, const device Pose& Pose_1, device Splats& Splats_1)
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
        transform = bind_skin_matrix(param, BindStatic_1, constants, Pose_1);
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
    float4 mean = Splats_1._data[row];
    float3 param_3 = mean.xyz;
    uint param_4 = row;
    float3 _1230 = bind_corrected(param_3, param_4, BindStatic_1, constants, Pose_1);
    uint param_5 = row;
    Rows4 param_6 = transform;
    Rows3 param_7 = rotation;
    float3 param_8 = _1230;
    float3 param_9 = bind_late(param_5, BindStatic_1, constants, Pose_1);
    float4 param_10 = Splats_1._data[constants.count + row];
    BoundSplat b = bind_by_matrix(param_6, param_7, param_8, param_9, param_10);
    if (constants.sh_direction == 1u)
    {
        b.sh_rotation = identity_rows();
    }
    BoundSplat param_11 = b;
    Rows4 param_12 = world;
    float4 param_13 = constants.world_quat_wxyz;
    BoundSplat _1264 = bind_place(param_11, param_12, param_13);
    b = _1264;
    Splats_1._data[row] = float4(b.mean, mean.w);
    Splats_1._data[constants.count + row] = b.quat_wxyz;
    Splats_1._data[(2u * constants.count) + row] = float4(b.sh_rotation.row0, ((device float*)&Splats_1._data[(2u * constants.count) + row])[3u]);
    Splats_1._data[(3u * constants.count) + row] = float4(b.sh_rotation.row1, ((device float*)&Splats_1._data[(3u * constants.count) + row])[3u]);
    Splats_1._data[(4u * constants.count) + row] = float4(b.sh_rotation.row2, ((device float*)&Splats_1._data[(4u * constants.count) + row])[3u]);
}

kernel void bind_skin(const device BindStatic& BindStatic_1 [[buffer(0)]], const device Pose& Pose_1 [[buffer(1)]], device Splats& Splats_1 [[buffer(2)]], constant BindSkinConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _bind_skin(param, BindStatic_1, constants, Pose_1, Splats_1);
}

