#version 310 es
// Generated from hlsl/light_normals.hlsl, entry light_normals, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

struct Rows3
{
    vec3 row0;
    vec3 row1;
    vec3 row2;
};

layout(binding = 0, std430) readonly buffer EmbedStatic
{
    uint _data[];
} EmbedStatic_1;

layout(binding = 1, std430) readonly buffer LightStatic
{
    uint _data[];
} LightStatic_1;

layout(binding = 8, std140) uniform LightNormalsConstants
{
    vec4 world_quat_wxyz;
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
} constants;

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

uint light_code(uint section, uint index, uint width)
{
    if (width == 32u)
    {
        return LightStatic_1._data[section + index];
    }
    uint bit = index * width;
    uint param = LightStatic_1._data[section + (bit >> uint(5))];
    uint param_1 = bit;
    uint param_2 = width;
    return packed_element(param, param_1, param_2);
}

float light_linear(uint section, uint index, uint width, uint scale)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = light_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    return uintBitsToFloat(LightStatic_1._data[scale]) + (uintBitsToFloat(LightStatic_1._data[scale + 1u]) * float(code));
}

vec3 light_linear3(uint section, uint index, uint stride, uint width, uint scale)
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
    return vec3(light_linear(param, param_1, param_2, param_3), light_linear(param_4, param_5, param_6, param_7), light_linear(param_8, param_9, param_10, param_11));
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

vec3 rotate(Rows3 m, vec3 v)
{
    return vec3(dot(m.row0, v), dot(m.row1, v), dot(m.row2, v));
}

void _light_normals(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    uint param = constants.triangle_ids;
    uint param_1 = row;
    uint param_2 = constants.triangle_ids_width;
    vec4 turn = Triangles_1._data[constants.triangles + embed_code(param, param_1, param_2)];
    uint param_3 = constants.local_quat;
    uint param_4 = row;
    uint param_5 = constants.local_quat_width;
    uint param_6 = constants.local_quat_scale;
    uint param_7 = constants.local_quat;
    uint param_8 = constants.count + row;
    uint param_9 = constants.count;
    uint param_10 = constants.local_quat_width;
    uint param_11 = constants.local_quat_scale + 2u;
    vec4 own = vec4(embed_linear(param_3, param_4, param_5, param_6), embed_linear3(param_7, param_8, param_9, param_10, param_11));
    uint param_12 = constants.normal;
    uint param_13 = row;
    uint param_14 = constants.count;
    uint param_15 = constants.normal_width;
    uint param_16 = constants.normal_scale;
    vec3 n = light_linear3(param_12, param_13, param_14, param_15, param_16);
    vec4 param_17 = own / vec4(max(length(own), 9.9999999600419720025001879548654e-13));
    Rows3 param_18 = matrix_from_quat(param_17);
    vec3 param_19 = n;
    n = rotate(param_18, param_19);
    vec4 param_20 = constants.world_quat_wxyz;
    vec4 param_21 = turn;
    Rows3 param_22 = matrix_from_quat(param_21);
    vec3 param_23 = n;
    Rows3 param_24 = matrix_from_quat(param_20);
    vec3 param_25 = rotate(param_22, param_23);
    n = rotate(param_24, param_25);
    Splats_1._data[(5u * constants.count) + row] = vec4(n, 0.0);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _light_normals(param);
}

