// Copy of avatar_shaders/hlsl/splat.hlsli, by `python -m avatar_shaders`; do not edit.
// Functions of several stages: rotations, covariance, spherical harmonics.
// Reads: nothing. Writes: nothing.
//
// Quaternions are float4 in the order (w, x, y, z): q.x is w. Matrices are structs of rows, so the packing order of an
// engine cannot transpose them.
#ifndef AVATAR_SPLAT_HLSLI
#define AVATAR_SPLAT_HLSLI

#include "constants_core.hlsl"

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

float3 rotate(Rows3 m, float3 v)
{
    return float3(dot(m.row0, v), dot(m.row1, v), dot(m.row2, v));
}

float3 rotate_inverse(Rows3 m, float3 v)
{
    return m.row0 * v.x + m.row1 * v.y + m.row2 * v.z;
}

float3 transform_point(Rows4 m, float3 p)
{
    return float3(
        m.row0.x * p.x + m.row0.y * p.y + m.row0.z * p.z + m.row0.w,
        m.row1.x * p.x + m.row1.y * p.y + m.row1.z * p.z + m.row1.w,
        m.row2.x * p.x + m.row2.y * p.y + m.row2.z * p.z + m.row2.w);
}

Rows3 linear_part(Rows4 m)
{
    Rows3 r;
    r.row0 = m.row0.xyz;
    r.row1 = m.row1.xyz;
    r.row2 = m.row2.xyz;
    return r;
}

Rows3 identity_rows()
{
    Rows3 r;
    r.row0 = float3(1, 0, 0);
    r.row1 = float3(0, 1, 0);
    r.row2 = float3(0, 0, 1);
    return r;
}

// a b
Rows3 multiply(Rows3 a, Rows3 b)
{
    Rows3 r;
    r.row0 = rotate_inverse(b, a.row0);
    r.row1 = rotate_inverse(b, a.row1);
    r.row2 = rotate_inverse(b, a.row2);
    return r;
}

// a b^T
Rows3 multiply_transposed(Rows3 a, Rows3 b)
{
    Rows3 r;
    r.row0 = rotate(b, a.row0);
    r.row1 = rotate(b, a.row1);
    r.row2 = rotate(b, a.row2);
    return r;
}

// Hamilton product a b.
float4 quat_multiply(float4 a, float4 b)
{
    return float4(
        a.x * b.x - a.y * b.y - a.z * b.z - a.w * b.w,
        a.x * b.y + a.y * b.x + a.z * b.w - a.w * b.z,
        a.x * b.z - a.y * b.w + a.z * b.x + a.w * b.y,
        a.x * b.w + a.y * b.z - a.z * b.y + a.w * b.x);
}

// Rotation of a quaternion that is not normalised here. The zero quaternion gives the identity.
Rows3 matrix_from_quat(float4 q)
{
    float w = q.x, x = q.y, y = q.z, z = q.w;
    Rows3 r;
    r.row0 = float3(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y));
    r.row1 = float3(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x));
    r.row2 = float3(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y));
    return r;
}

// Unit quaternion of a rotation. Its largest component is positive.
float4 quat_from_matrix(Rows3 m)
{
    float d0 = m.row0.x, d1 = m.row1.y, d2 = m.row2.z;
    float4 size = sqrt(max(float4(1 + d0 + d1 + d2, 1 + d0 - d1 - d2, 1 - d0 + d1 - d2, 1 - d0 - d1 + d2), 0.0));
    float a = m.row2.y - m.row1.z, b = m.row0.z - m.row2.x, c = m.row1.x - m.row0.y;
    float d = m.row1.x + m.row0.y, e = m.row0.z + m.row2.x, f = m.row2.y + m.row1.z;
    if (size.x >= size.y && size.x >= size.z && size.x >= size.w)
    {
        return float4(size.x * size.x, a, b, c) / (2 * size.x);
    }
    if (size.y >= size.z && size.y >= size.w)
    {
        return float4(a, size.y * size.y, d, e) / (2 * size.y);
    }
    if (size.z >= size.w)
    {
        return float4(b, d, size.z * size.z, f) / (2 * size.z);
    }
    return float4(c, e, f, size.w * size.w) / (2 * size.w);
}

// Rotation factor by Newton steps R <- (R + R^-T) / 2. The trainer takes the same number of steps.
Rows3 polar(Rows3 m)
{
    for (int step = 0; step < AVATAR_POLAR_STEPS; ++step)
    {
        float3 c0 = cross(m.row1, m.row2), c1 = cross(m.row2, m.row0), c2 = cross(m.row0, m.row1);
        float determinant = dot(m.row0, c0);
        m.row0 = (m.row0 + c0 / determinant) * 0.5;
        m.row1 = (m.row1 + c1 / determinant) * 0.5;
        m.row2 = (m.row2 + c2 / determinant) * 0.5;
    }
    return m;
}

struct Covariance
{
    float xx;
    float xy;
    float xz;
    float yy;
    float yz;
    float zz;
};

// R S S R^T of standard deviations S and a quaternion that is not normalised here.
Covariance covariance(float3 scale, float4 quat_wxyz)
{
    Rows3 r = matrix_from_quat(quat_wxyz);
    float3 m0 = r.row0 * scale, m1 = r.row1 * scale, m2 = r.row2 * scale;
    Covariance s;
    s.xx = dot(m0, m0);
    s.xy = dot(m0, m1);
    s.xz = dot(m0, m2);
    s.yy = dot(m1, m1);
    s.yz = dot(m1, m2);
    s.zz = dot(m2, m2);
    return s;
}

// Spherical harmonics band by band. d is the unit direction from the eye to the splat in the frame of the
// coefficients (R^T d). The colour is the sum of the bands + 0.5, at least 0.
float3 sh_band0(float3 k0)
{
    return AVATAR_SH_C0_0 * k0;
}

float3 sh_band1(float3 d, float3 k1, float3 k2, float3 k3)
{
    return AVATAR_SH_C1_0 * d.y * k1 + AVATAR_SH_C1_1 * d.z * k2 + AVATAR_SH_C1_2 * d.x * k3;
}

float3 sh_band2(float3 d, float3 k4, float3 k5, float3 k6, float3 k7, float3 k8)
{
    float xx = d.x * d.x, yy = d.y * d.y, zz = d.z * d.z;
    return AVATAR_SH_C2_0 * (d.x * d.y) * k4
        + AVATAR_SH_C2_1 * (d.y * d.z) * k5
        + AVATAR_SH_C2_2 * (2 * zz - xx - yy) * k6
        + AVATAR_SH_C2_3 * (d.x * d.z) * k7
        + AVATAR_SH_C2_4 * (xx - yy) * k8;
}

float3 sh_band3(float3 d, float3 k9, float3 k10, float3 k11, float3 k12, float3 k13, float3 k14, float3 k15)
{
    float xx = d.x * d.x, yy = d.y * d.y, zz = d.z * d.z;
    return AVATAR_SH_C3_0 * d.y * (3 * xx - yy) * k9
        + AVATAR_SH_C3_1 * (d.x * d.y) * d.z * k10
        + AVATAR_SH_C3_2 * d.y * (4 * zz - xx - yy) * k11
        + AVATAR_SH_C3_3 * d.z * (2 * zz - 3 * xx - 3 * yy) * k12
        + AVATAR_SH_C3_4 * d.x * (4 * zz - xx - yy) * k13
        + AVATAR_SH_C3_5 * d.z * (xx - yy) * k14
        + AVATAR_SH_C3_6 * d.x * (xx - 3 * yy) * k15;
}

#endif
