#version 310 es
// Generated from hlsl/blend.hlsl, entry blend, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

struct BlendGeometry
{
    vec3 mean;
    vec4 quat_wxyz;
};

struct BlendAppearance
{
    vec3 log_scale;
    float opacity_logit;
};

layout(binding = 0, std430) readonly buffer BlendStatic
{
    uint _data[];
} BlendStatic_1;

layout(binding = 8, std140) uniform BlendConstants
{
    uint count;
    uint sh_terms;
    uint weights;
    uint base_mean;
    uint base_mean_width;
    uint base_mean_scale;
    uint base_log_scale;
    uint base_log_scale_width;
    uint base_log_scale_scale;
    uint base_quat;
    uint base_quat_width;
    uint base_quat_scale;
    uint base_opacity;
    uint base_opacity_width;
    uint base_opacity_table;
    uint base_sh;
    uint base_sh_width;
    uint base_sh_scale;
    uint geometry_ptr;
    uint geometry_column;
    uint geometry_column_width;
    uint geometry_mean;
    uint geometry_mean_width;
    uint geometry_mean_step;
    uint geometry_quat;
    uint geometry_quat_width;
    uint geometry_quat_step;
    uint appearance_ptr;
    uint appearance_column;
    uint appearance_column_width;
    uint appearance_log_scale;
    uint appearance_log_scale_width;
    uint appearance_log_scale_step;
    uint appearance_opacity;
    uint appearance_opacity_width;
    uint appearance_opacity_step;
    uint appearance_sh;
    uint appearance_sh_width;
    uint appearance_sh_step;
    uint unused;
} constants;

layout(binding = 1, std430) readonly buffer Pose
{
    float _data[];
} Pose_1;

layout(binding = 3, std430) buffer Sh
{
    float _data[];
} Sh_1;

layout(binding = 2, std430) buffer Splats
{
    vec4 _data[];
} Splats_1;

uint packed_element(uint word, uint bit, uint width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

uint blend_code(uint section, uint index, uint width)
{
    if (width == 32u)
    {
        return BlendStatic_1._data[section + index];
    }
    uint bit = index * width;
    uint param = BlendStatic_1._data[section + (bit >> uint(5))];
    uint param_1 = bit;
    uint param_2 = width;
    return packed_element(param, param_1, param_2);
}

float blend_linear(uint section, uint index, uint width, uint scale)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = blend_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    return uintBitsToFloat(BlendStatic_1._data[scale]) + (uintBitsToFloat(BlendStatic_1._data[scale + 1u]) * float(code));
}

vec3 blend_linear3(uint section, uint index, uint stride, uint width, uint scale)
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
    return vec3(blend_linear(param, param_1, param_2, param_3), blend_linear(param_4, param_5, param_6, param_7), blend_linear(param_8, param_9, param_10, param_11));
}

float packed_step_count(uint code, uint width)
{
    return float(code) - float(1u << (width - 1u));
}

float blend_signed(uint section, uint index, uint width, uint _step)
{
    if (width == 0u)
    {
        return 0.0;
    }
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = blend_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    uint param_3 = code;
    uint param_4 = width;
    return uintBitsToFloat(BlendStatic_1._data[_step]) * packed_step_count(param_3, param_4);
}

vec3 blend_signed3(uint section, uint index, uint width, uint _step)
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
    return vec3(blend_signed(param, param_1, param_2, param_3), blend_signed(param_4, param_5, param_6, param_7), blend_signed(param_8, param_9, param_10, param_11));
}

BlendGeometry blend_geometry(inout BlendGeometry g, float weight, vec3 mean, vec4 quat_wxyz)
{
    g.mean += (mean * weight);
    g.quat_wxyz += (quat_wxyz * weight);
    return g;
}

BlendGeometry blended_geometry(uint row)
{
    uint param = constants.base_mean;
    uint param_1 = row;
    uint param_2 = constants.count;
    uint param_3 = constants.base_mean_width;
    uint param_4 = constants.base_mean_scale;
    BlendGeometry g;
    g.mean = blend_linear3(param, param_1, param_2, param_3, param_4);
    uint param_5 = constants.base_quat;
    uint param_6 = row;
    uint param_7 = constants.base_quat_width;
    uint param_8 = constants.base_quat_scale;
    uint param_9 = constants.base_quat;
    uint param_10 = constants.count + row;
    uint param_11 = constants.count;
    uint param_12 = constants.base_quat_width;
    uint param_13 = constants.base_quat_scale + 2u;
    g.quat_wxyz = vec4(blend_linear(param_5, param_6, param_7, param_8), blend_linear3(param_9, param_10, param_11, param_12, param_13));
    uint end = BlendStatic_1._data[(constants.geometry_ptr + row) + 1u];
    uint _481 = constants.geometry_ptr + row;
    for (uint e = BlendStatic_1._data[_481]; e < end; e++)
    {
        uint param_14 = constants.geometry_column;
        uint param_15 = e;
        uint param_16 = constants.geometry_column_width;
        uint column = blend_code(param_14, param_15, param_16);
        float weight = Pose_1._data[constants.weights + column];
        if (weight != 0.0)
        {
            uint param_17 = constants.geometry_mean;
            uint param_18 = 3u * e;
            uint param_19 = constants.geometry_mean_width;
            uint param_20 = constants.geometry_mean_step + (3u * column);
            vec3 mean = blend_signed3(param_17, param_18, param_19, param_20);
            uint _step = constants.geometry_quat_step + (4u * column);
            uint param_21 = constants.geometry_quat;
            uint param_22 = 4u * e;
            uint param_23 = constants.geometry_quat_width;
            uint param_24 = _step;
            uint param_25 = constants.geometry_quat;
            uint param_26 = (4u * e) + 1u;
            uint param_27 = constants.geometry_quat_width;
            uint param_28 = _step + 1u;
            vec4 quat_wxyz = vec4(blend_signed(param_21, param_22, param_23, param_24), blend_signed3(param_25, param_26, param_27, param_28));
            BlendGeometry param_29 = g;
            float param_30 = weight;
            vec3 param_31 = mean;
            vec4 param_32 = quat_wxyz;
            BlendGeometry _590 = blend_geometry(param_29, param_30, param_31, param_32);
            g = _590;
        }
    }
    return g;
}

float blend_table(uint section, uint index, uint width, uint table)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = blend_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    return uintBitsToFloat(BlendStatic_1._data[table + code]);
}

BlendAppearance blend_appearance(inout BlendAppearance a, float weight, vec3 log_scale, float opacity_logit)
{
    a.log_scale += (log_scale * weight);
    a.opacity_logit += (weight * opacity_logit);
    return a;
}

BlendAppearance blended_appearance(uint row)
{
    uint param = constants.base_log_scale;
    uint param_1 = row;
    uint param_2 = constants.count;
    uint param_3 = constants.base_log_scale_width;
    uint param_4 = constants.base_log_scale_scale;
    BlendAppearance a;
    a.log_scale = blend_linear3(param, param_1, param_2, param_3, param_4);
    uint param_5 = constants.base_opacity;
    uint param_6 = row;
    uint param_7 = constants.base_opacity_width;
    uint param_8 = constants.base_opacity_table;
    a.opacity_logit = blend_table(param_5, param_6, param_7, param_8);
    uint end = BlendStatic_1._data[(constants.appearance_ptr + row) + 1u];
    uint _645 = constants.appearance_ptr + row;
    for (uint e = BlendStatic_1._data[_645]; e < end; e++)
    {
        uint param_9 = constants.appearance_column;
        uint param_10 = e;
        uint param_11 = constants.appearance_column_width;
        uint column = blend_code(param_9, param_10, param_11);
        float weight = Pose_1._data[constants.weights + column];
        if (weight != 0.0)
        {
            uint param_12 = constants.appearance_log_scale;
            uint param_13 = 3u * e;
            uint param_14 = constants.appearance_log_scale_width;
            uint param_15 = constants.appearance_log_scale_step + (3u * column);
            vec3 log_scale = blend_signed3(param_12, param_13, param_14, param_15);
            uint param_16 = constants.appearance_opacity;
            uint param_17 = e;
            uint param_18 = constants.appearance_opacity_width;
            uint param_19 = constants.appearance_opacity_step + column;
            float opacity_logit = blend_signed(param_16, param_17, param_18, param_19);
            BlendAppearance param_20 = a;
            float param_21 = weight;
            vec3 param_22 = log_scale;
            float param_23 = opacity_logit;
            BlendAppearance _725 = blend_appearance(param_20, param_21, param_22, param_23);
            a = _725;
        }
    }
    return a;
}

vec3 blend_base_sh(uint t, uint row)
{
    uint param = constants.base_sh;
    uint param_1 = (t * constants.count) + row;
    uint param_2 = constants.count;
    uint param_3 = constants.base_sh_width;
    uint param_4 = constants.base_sh_scale + (2u * t);
    return blend_linear3(param, param_1, param_2, param_3, param_4);
}

vec3 blend_sh(vec3 coefficient, float weight, vec3 delta)
{
    return coefficient + (delta * weight);
}

void blend_store_sh(uint k, uint row, vec3 coefficient)
{
    if (k < constants.sh_terms)
    {
        uint at = ((3u * k) * constants.count) + row;
        Sh_1._data[at] = coefficient.x;
        Sh_1._data[at + constants.count] = coefficient.y;
        Sh_1._data[at + (2u * constants.count)] = coefficient.z;
    }
}

void blend_sh_from(uint k, uint row)
{
    uint last = constants.sh_terms - 1u;
    uint terms = 3u * constants.sh_terms;
    uint t0 = 3u * k;
    uint t1 = 3u * min((k + 1u), last);
    uint t2 = 3u * min((k + 2u), last);
    uint t3 = 3u * min((k + 3u), last);
    uint param = t0;
    uint param_1 = row;
    vec3 c0 = blend_base_sh(param, param_1);
    uint param_2 = t1;
    uint param_3 = row;
    vec3 c1 = blend_base_sh(param_2, param_3);
    uint param_4 = t2;
    uint param_5 = row;
    vec3 c2 = blend_base_sh(param_4, param_5);
    uint param_6 = t3;
    uint param_7 = row;
    vec3 c3 = blend_base_sh(param_6, param_7);
    uint end = BlendStatic_1._data[(constants.appearance_ptr + row) + 1u];
    if (constants.appearance_sh_width == 0u)
    {
        end = 0u;
    }
    uint _839 = constants.appearance_ptr + row;
    for (uint e = BlendStatic_1._data[_839]; e < end; e++)
    {
        uint param_8 = constants.appearance_column;
        uint param_9 = e;
        uint param_10 = constants.appearance_column_width;
        uint column = blend_code(param_8, param_9, param_10);
        float weight = Pose_1._data[constants.weights + column];
        if (weight != 0.0)
        {
            uint at = terms * e;
            uint _step = constants.appearance_sh_step + (terms * column);
            uint param_11 = constants.appearance_sh;
            uint param_12 = at + t0;
            uint param_13 = constants.appearance_sh_width;
            uint param_14 = _step + t0;
            vec3 param_15 = c0;
            float param_16 = weight;
            vec3 param_17 = blend_signed3(param_11, param_12, param_13, param_14);
            c0 = blend_sh(param_15, param_16, param_17);
            uint param_18 = constants.appearance_sh;
            uint param_19 = at + t1;
            uint param_20 = constants.appearance_sh_width;
            uint param_21 = _step + t1;
            vec3 param_22 = c1;
            float param_23 = weight;
            vec3 param_24 = blend_signed3(param_18, param_19, param_20, param_21);
            c1 = blend_sh(param_22, param_23, param_24);
            uint param_25 = constants.appearance_sh;
            uint param_26 = at + t2;
            uint param_27 = constants.appearance_sh_width;
            uint param_28 = _step + t2;
            vec3 param_29 = c2;
            float param_30 = weight;
            vec3 param_31 = blend_signed3(param_25, param_26, param_27, param_28);
            c2 = blend_sh(param_29, param_30, param_31);
            uint param_32 = constants.appearance_sh;
            uint param_33 = at + t3;
            uint param_34 = constants.appearance_sh_width;
            uint param_35 = _step + t3;
            vec3 param_36 = c3;
            float param_37 = weight;
            vec3 param_38 = blend_signed3(param_32, param_33, param_34, param_35);
            c3 = blend_sh(param_36, param_37, param_38);
        }
    }
    uint param_39 = k;
    uint param_40 = row;
    vec3 param_41 = c0;
    blend_store_sh(param_39, param_40, param_41);
    uint param_42 = k + 1u;
    uint param_43 = row;
    vec3 param_44 = c1;
    blend_store_sh(param_42, param_43, param_44);
    uint param_45 = k + 2u;
    uint param_46 = row;
    vec3 param_47 = c2;
    blend_store_sh(param_45, param_46, param_47);
    uint param_48 = k + 3u;
    uint param_49 = row;
    vec3 param_50 = c3;
    blend_store_sh(param_48, param_49, param_50);
}

void _blend(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    uint param = row;
    BlendGeometry g = blended_geometry(param);
    uint param_1 = row;
    BlendAppearance a = blended_appearance(param_1);
    Splats_1._data[row] = vec4(g.mean, a.opacity_logit);
    Splats_1._data[constants.count + row] = g.quat_wxyz;
    Splats_1._data[(2u * constants.count) + row] = vec4(1.0, 0.0, 0.0, a.log_scale.x);
    Splats_1._data[(3u * constants.count) + row] = vec4(0.0, 1.0, 0.0, a.log_scale.y);
    Splats_1._data[(4u * constants.count) + row] = vec4(0.0, 0.0, 1.0, a.log_scale.z);
    for (uint k = 0u; k < constants.sh_terms; k += 4u)
    {
        uint param_2 = k;
        uint param_3 = row;
        blend_sh_from(param_2, param_3);
    }
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _blend(param);
}

