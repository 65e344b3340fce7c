// Generated from hlsl/light_normals.hlsl, entry light_normals, by `python -m avatar_shaders`; do not edit.
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

struct EmbedStatic
{
    uint _data[1];
};

struct LightNormalsConstants
{
    float4 world_quat_wxyz;
    uint count;
    uint triangles;
    uint triangle_ids;
    uint triangle_ids_width;
    uint local_quat;
    uint local_quat_width;
    uint local_quat_scale;
    uint normal;
    uint normal_width;
    uint normal_scale;
};

struct Triangles
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
uint light_code(thread const uint& section, thread const uint& index, thread const uint& width, const device EmbedStatic& LightStatic)
{
    if (width == 32u)
    {
        return LightStatic._data[section + index];
    }
    uint bit = index * width;
    uint param = LightStatic._data[section + (bit >> uint(5))];
    uint param_1 = bit;
    uint param_2 = width;
    return packed_element(param, param_1, param_2);
}

static inline __attribute__((always_inline))
float light_linear(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& scale, const device EmbedStatic& LightStatic)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = light_code(param, param_1, param_2, LightStatic);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    return as_type<float>(LightStatic._data[scale]) + (as_type<float>(LightStatic._data[scale + 1u]) * float(code));
}

static inline __attribute__((always_inline))
float3 light_linear3(thread const uint& section, thread const uint& index, thread const uint& stride, thread const uint& width, thread const uint& scale, const device EmbedStatic& LightStatic)
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
    return float3(light_linear(param, param_1, param_2, param_3, LightStatic), light_linear(param_4, param_5, param_6, param_7, LightStatic), light_linear(param_8, param_9, param_10, param_11, LightStatic));
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
float3 rotate(thread const Rows3& m, thread const float3& v)
{
    return float3(dot(m.row0, v), dot(m.row1, v), dot(m.row2, v));
}

static inline __attribute__((always_inline))
void _light_normals(thread const uint3& id, const device EmbedStatic& EmbedStatic_1, const device EmbedStatic& LightStatic, constant LightNormalsConstants& constants, const device Triangles& Triangles_1, device Splats& Splats_1)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    uint param = constants.triangle_ids;
    uint param_1 = row;
    uint param_2 = constants.triangle_ids_width;
    float4 turn = Triangles_1._data[constants.triangles + embed_code(param, param_1, param_2, EmbedStatic_1)];
    uint param_3 = constants.local_quat;
    uint param_4 = row;
    uint param_5 = constants.local_quat_width;
    uint param_6 = constants.local_quat_scale;
    uint param_7 = constants.local_quat;
    uint param_8 = constants.count + row;
    uint param_9 = constants.count;
    uint param_10 = constants.local_quat_width;
    uint param_11 = constants.local_quat_scale + 2u;
    float4 own = float4(embed_linear(param_3, param_4, param_5, param_6, EmbedStatic_1), embed_linear3(param_7, param_8, param_9, param_10, param_11, EmbedStatic_1));
    uint param_12 = constants.normal;
    uint param_13 = row;
    uint param_14 = constants.count;
    uint param_15 = constants.normal_width;
    uint param_16 = constants.normal_scale;
    float3 n = light_linear3(param_12, param_13, param_14, param_15, param_16, LightStatic);
    float4 param_17 = own / float4(fast::max(length(own), 9.9999999600419720025001879548654e-13));
    Rows3 param_18 = matrix_from_quat(param_17);
    float3 param_19 = n;
    n = rotate(param_18, param_19);
    float4 param_20 = constants.world_quat_wxyz;
    float4 param_21 = turn;
    Rows3 param_22 = matrix_from_quat(param_21);
    float3 param_23 = n;
    Rows3 param_24 = matrix_from_quat(param_20);
    float3 param_25 = rotate(param_22, param_23);
    n = rotate(param_24, param_25);
    Splats_1._data[(5u * constants.count) + row] = float4(n, 0.0);
}

kernel void light_normals(const device EmbedStatic& EmbedStatic_1 [[buffer(0)]], const device EmbedStatic& LightStatic [[buffer(1)]], const device Triangles& Triangles_1 [[buffer(2)]], device Splats& Splats_1 [[buffer(3)]], constant LightNormalsConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _light_normals(param, EmbedStatic_1, LightStatic, constants, Triangles_1, Splats_1);
}

