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
    uint base_plane;
    uint geometry_ptr;
    uint geometry_entry;
    uint appearance_ptr;
    uint appearance_entry;
    uint weights;
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

float blend_value(uint at)
{
    return uintBitsToFloat(BlendStatic_1._data[at]);
}

float blend_base(uint plane, uint row)
{
    uint param = (constants.base_plane + (plane * constants.count)) + row;
    return blend_value(param);
}

vec3 blend_base3(uint plane, uint row)
{
    uint param = plane;
    uint param_1 = row;
    uint param_2 = plane + 1u;
    uint param_3 = row;
    uint param_4 = plane + 2u;
    uint param_5 = row;
    return vec3(blend_base(param, param_1), blend_base(param_2, param_3), blend_base(param_4, param_5));
}

vec3 blend_value3(uint at)
{
    uint param = at;
    uint param_1 = at + 1u;
    uint param_2 = at + 2u;
    return vec3(blend_value(param), blend_value(param_1), blend_value(param_2));
}

BlendGeometry blend_geometry(inout BlendGeometry g, float weight, vec3 mean, vec4 quat_wxyz)
{
    g.mean += (mean * weight);
    g.quat_wxyz += (quat_wxyz * weight);
    return g;
}

BlendGeometry blended_geometry(uint row)
{
    uint param = 0u;
    uint param_1 = row;
    BlendGeometry g;
    g.mean = blend_base3(param, param_1);
    uint param_2 = 6u;
    uint param_3 = row;
    uint param_4 = 7u;
    uint param_5 = row;
    g.quat_wxyz = vec4(blend_base(param_2, param_3), blend_base3(param_4, param_5));
    uint end = BlendStatic_1._data[(constants.geometry_ptr + row) + 1u];
    uint _224 = constants.geometry_ptr + row;
    for (uint e = BlendStatic_1._data[_224]; e < end; e++)
    {
        uint at = constants.geometry_entry + (8u * e);
        float weight = Pose_1._data[constants.weights + BlendStatic_1._data[at]];
        if (weight != 0.0)
        {
            uint param_6 = at + 1u;
            uint param_7 = at + 4u;
            uint param_8 = at + 5u;
            BlendGeometry param_9 = g;
            float param_10 = weight;
            vec3 param_11 = blend_value3(param_6);
            vec4 param_12 = vec4(blend_value(param_7), blend_value3(param_8));
            BlendGeometry _288 = blend_geometry(param_9, param_10, param_11, param_12);
            g = _288;
        }
    }
    return g;
}

BlendAppearance blend_appearance(inout BlendAppearance a, float weight, vec3 log_scale, float opacity_logit)
{
    a.log_scale += (log_scale * weight);
    a.opacity_logit += (weight * opacity_logit);
    return a;
}

BlendAppearance blended_appearance(uint row)
{
    uint param = 3u;
    uint param_1 = row;
    BlendAppearance a;
    a.log_scale = blend_base3(param, param_1);
    uint param_2 = 10u;
    uint param_3 = row;
    a.opacity_logit = blend_base(param_2, param_3);
    uint end = BlendStatic_1._data[(constants.appearance_ptr + row) + 1u];
    uint _320 = constants.appearance_ptr + row;
    for (uint e = BlendStatic_1._data[_320]; e < end; e++)
    {
        uint at = constants.appearance_entry + ((5u + (3u * constants.sh_terms)) * e);
        float weight = Pose_1._data[constants.weights + BlendStatic_1._data[at]];
        if (weight != 0.0)
        {
            uint param_4 = at + 1u;
            uint param_5 = at + 4u;
            BlendAppearance param_6 = a;
            float param_7 = weight;
            vec3 param_8 = blend_value3(param_4);
            float param_9 = blend_value(param_5);
            BlendAppearance _369 = blend_appearance(param_6, param_7, param_8, param_9);
            a = _369;
        }
    }
    return a;
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
    uint stride = 5u + (3u * constants.sh_terms);
    uint t0 = 3u * k;
    uint t1 = 3u * min((k + 1u), last);
    uint t2 = 3u * min((k + 2u), last);
    uint t3 = 3u * min((k + 3u), last);
    uint param = 11u + t0;
    uint param_1 = row;
    vec3 c0 = blend_base3(param, param_1);
    uint param_2 = 11u + t1;
    uint param_3 = row;
    vec3 c1 = blend_base3(param_2, param_3);
    uint param_4 = 11u + t2;
    uint param_5 = row;
    vec3 c2 = blend_base3(param_4, param_5);
    uint param_6 = 11u + t3;
    uint param_7 = row;
    vec3 c3 = blend_base3(param_6, param_7);
    uint end = BlendStatic_1._data[(constants.appearance_ptr + row) + 1u];
    uint _483 = constants.appearance_ptr + row;
    for (uint e = BlendStatic_1._data[_483]; e < end; e++)
    {
        uint at = constants.appearance_entry + (stride * e);
        float weight = Pose_1._data[constants.weights + BlendStatic_1._data[at]];
        if (weight != 0.0)
        {
            uint param_8 = (at + 5u) + t0;
            vec3 param_9 = c0;
            float param_10 = weight;
            vec3 param_11 = blend_value3(param_8);
            c0 = blend_sh(param_9, param_10, param_11);
            uint param_12 = (at + 5u) + t1;
            vec3 param_13 = c1;
            float param_14 = weight;
            vec3 param_15 = blend_value3(param_12);
            c1 = blend_sh(param_13, param_14, param_15);
            uint param_16 = (at + 5u) + t2;
            vec3 param_17 = c2;
            float param_18 = weight;
            vec3 param_19 = blend_value3(param_16);
            c2 = blend_sh(param_17, param_18, param_19);
            uint param_20 = (at + 5u) + t3;
            vec3 param_21 = c3;
            float param_22 = weight;
            vec3 param_23 = blend_value3(param_20);
            c3 = blend_sh(param_21, param_22, param_23);
        }
    }
    uint param_24 = k;
    uint param_25 = row;
    vec3 param_26 = c0;
    blend_store_sh(param_24, param_25, param_26);
    uint param_27 = k + 1u;
    uint param_28 = row;
    vec3 param_29 = c1;
    blend_store_sh(param_27, param_28, param_29);
    uint param_30 = k + 2u;
    uint param_31 = row;
    vec3 param_32 = c2;
    blend_store_sh(param_30, param_31, param_32);
    uint param_33 = k + 3u;
    uint param_34 = row;
    vec3 param_35 = c3;
    blend_store_sh(param_33, param_34, param_35);
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

