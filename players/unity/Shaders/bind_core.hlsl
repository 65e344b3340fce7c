// Copy of avatar_shaders/hlsl/bind.hlsli, by `python -m avatar_shaders`; do not edit.
// Core of stage `bind`: how joints, a group or a triangle mesh move one Gaussian.
// Reads: nothing. Writes: nothing.
#ifndef AVATAR_BIND_HLSLI
#define AVATAR_BIND_HLSLI

#include "rules_core.hlsl"
#include "splat_core.hlsl"
#include "skin_core.hlsl"

// Prevents a division by 0 for vectors without a length.
static const float AVATAR_TINY = 1e-30;

struct BoundSplat
{
    float3 mean;
    float4 quat_wxyz;
    Rows3 sh_rotation; // colour is seen along sh_rotation^T d
};

// A Gaussian moved by a matrix. `rotation` turns its axes and its SH.
BoundSplat bind_by_matrix(Rows4 transform, Rows3 rotation, float3 mean, float3 late, float4 quat_wxyz)
{
    BoundSplat b;
    b.mean = transform_point(transform, mean) + late;
    b.quat_wxyz = quat_multiply(quat_from_matrix(rotation), quat_wxyz);
    b.sh_rotation = rotation;
    return b;
}

// Moves the posed avatar rigidly as a whole. The identity changes no bit.
BoundSplat bind_place(BoundSplat b, Rows4 world, float4 world_quat_wxyz)
{
    b.mean = transform_point(world, b.mean);
    b.quat_wxyz = quat_multiply(world_quat_wxyz, b.quat_wxyz);
    b.sh_rotation = multiply(linear_part(world), b.sh_rotation);
    return b;
}

float3 bind_unit(float3 v)
{
    return v / max(length(v), AVATAR_TINY);
}

float4 bind_unit4(float4 v)
{
    return v / max(sqrt(dot(v, v)), AVATAR_TINY);
}

struct TriangleShape
{
    Rows3 frame; // its columns are the axes; world from triangle
    float size; // edge length for rotation rule triangle_frame, else area
    float3 across; // edge x edge, not normalised
};

Rows3 bind_columns(float3 x, float3 y, float3 z)
{
    Rows3 m;
    m.row0 = float3(x.x, y.x, z.x);
    m.row1 = float3(x.y, y.y, z.y);
    m.row2 = float3(x.z, y.z, z.z);
    return m;
}

// Frame and area as SplattingAvatar takes them (every rotation rule but triangle_frame).
TriangleShape triangle_by_area(float3 p0, float3 p1, float3 p2)
{
    TriangleShape t;
    float3 e = p1 - p0;
    t.across = cross(e, p2 - p0);
    float3 x = bind_unit(cross(e, bind_unit(t.across)));
    t.frame = bind_columns(x, bind_unit(cross(e, x)), bind_unit(e));
    t.size = length(t.across) / 2;
    return t;
}

// Frame and size as GaussianAvatars takes them (rotation rule triangle_frame).
TriangleShape triangle_by_edge(float3 p0, float3 p1, float3 p2)
{
    TriangleShape t;
    float3 e = p1 - p0, f = p2 - p0;
    t.across = cross(e, f);
    float3 a0 = bind_unit(e);
    float3 a1 = bind_unit(cross(a0, f));
    float3 a2 = -bind_unit(cross(a1, a0));
    t.frame = bind_columns(a0, a1, a2);
    t.size = (length(e) + abs(dot(a2, f))) / 2;
    return t;
}

// The turn of a triangle since the binding pose. `quaternion_sign` is a code of rules.hlsli.
float4 triangle_turn(Rows3 frame, Rows3 canonical_frame, uint quaternion_sign)
{
    float4 turn = quat_from_matrix(multiply_transposed(frame, canonical_frame));
    bool negative = quaternion_sign == AVATAR_QUATERNION_SIGN_W_POSITIVE && turn.x < 0;
    if (quaternion_sign == AVATAR_QUATERNION_SIGN_LARGEST_POSITIVE_MIRRORED)
    {
        // The largest component of `turn` is positive. A mirror in x negates y and z.
        negative = max(turn.z, turn.w) > max(turn.x, turn.y);
    }
    return negative ? -turn : turn;
}

// Normals and quaternions of vertices, from sums over their triangles. Floors are areas in bundle units squared.
float3 vertex_normal(float3 sum_across, float normal_floor)
{
    return sum_across / max(length(sum_across), normal_floor);
}

float4 vertex_quat(float4 sum_turn, float quaternion_floor)
{
    return sum_turn / max(sqrt(dot(sum_turn, sum_turn)), quaternion_floor);
}

// Rotation rule vertex_quaternion_mean: shorter than 1 where triangles turn apart.
float4 vertex_quat_mean(float4 sum_turn, float sum_area)
{
    return sum_turn / max(sum_area, AVATAR_TINY);
}

// Scale rule log_area: the damped ratio of areas multiplies the logarithm of the scale in training units.
float3 scale_log_area(float3 log_scale, float area, float canonical_area, float damping, float log_training_per_bundle)
{
    float ratio = (area + damping) / (canonical_area + damping);
    return (log_scale + log_training_per_bundle) * ratio - log_training_per_bundle;
}

// Scale rules linear_area and triangle_linear: the scale grows as the triangle's size.
float3 scale_linear(float3 log_scale, float size, float canonical_size)
{
    return log_scale + log(max(size, AVATAR_TINY) / canonical_size);
}

// A Gaussian embedded in a mesh: the turn of the mesh (any length) times the local quaternion of the Gaussian.
BoundSplat bind_by_turn(float3 mean, float4 turn, float4 local_quat_wxyz)
{
    BoundSplat b;
    float4 unit_turn = bind_unit4(turn);
    b.mean = mean;
    b.quat_wxyz = quat_multiply(unit_turn, local_quat_wxyz);
    b.sh_rotation = matrix_from_quat(unit_turn);
    return b;
}

#endif
