#version 430
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

BlendAppearance blend_appearance(inout BlendAppearance a, float weight, vec3 log_scale, float opacity_logit)
{
    a.log_scale += (log_scale * weight);
    a.opacity_logit += (weight * opacity_logit);
    return a;
}

float blend_sh(float coefficient, float weight, float delta)
{
    return coefficient + (weight * delta);
}

void _blend(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    uint param = 0u;
    uint param_1 = row;
    uint param_2 = 1u;
    uint param_3 = row;
    uint param_4 = 2u;
    uint param_5 = row;
    BlendGeometry g;
    g.mean = vec3(blend_base(param, param_1), blend_base(param_2, param_3), blend_base(param_4, param_5));
    uint param_6 = 6u;
    uint param_7 = row;
    uint param_8 = 7u;
    uint param_9 = row;
    uint param_10 = 8u;
    uint param_11 = row;
    uint param_12 = 9u;
    uint param_13 = row;
    g.quat_wxyz = vec4(blend_base(param_6, param_7), blend_base(param_8, param_9), blend_base(param_10, param_11), blend_base(param_12, param_13));
    uint end = BlendStatic_1._data[(constants.geometry_ptr + row) + 1u];
    uint _207 = constants.geometry_ptr + row;
    for (uint e = BlendStatic_1._data[_207]; e < end; e++)
    {
        uint at = constants.geometry_entry + (8u * e);
        float weight = Pose_1._data[constants.weights + BlendStatic_1._data[at]];
        if (weight != 0.0)
        {
            uint param_14 = at + 1u;
            uint param_15 = at + 4u;
            uint param_16 = at + 5u;
            BlendGeometry param_17 = g;
            float param_18 = weight;
            vec3 param_19 = blend_value3(param_14);
            vec4 param_20 = vec4(blend_value(param_15), blend_value3(param_16));
            BlendGeometry _269 = blend_geometry(param_17, param_18, param_19, param_20);
            g = _269;
        }
    }
    uint param_21 = 3u;
    uint param_22 = row;
    uint param_23 = 4u;
    uint param_24 = row;
    uint param_25 = 5u;
    uint param_26 = row;
    BlendAppearance a;
    a.log_scale = vec3(blend_base(param_21, param_22), blend_base(param_23, param_24), blend_base(param_25, param_26));
    uint param_27 = 10u;
    uint param_28 = row;
    a.opacity_logit = blend_base(param_27, param_28);
    uint terms = 3u * constants.sh_terms;
    for (uint s = 0u; s < terms; s++)
    {
        uint param_29 = 11u + s;
        uint param_30 = row;
        Sh_1._data[(s * constants.count) + row] = blend_base(param_29, param_30);
    }
    uint appearance_end = BlendStatic_1._data[(constants.appearance_ptr + row) + 1u];
    uint _340 = constants.appearance_ptr + row;
    for (uint i = BlendStatic_1._data[_340]; i < appearance_end; i++)
    {
        uint at_1 = constants.appearance_entry + ((5u + terms) * i);
        float weight_1 = Pose_1._data[constants.weights + BlendStatic_1._data[at_1]];
        if (weight_1 != 0.0)
        {
            uint param_31 = at_1 + 1u;
            uint param_32 = at_1 + 4u;
            BlendAppearance param_33 = a;
            float param_34 = weight_1;
            vec3 param_35 = blend_value3(param_31);
            float param_36 = blend_value(param_32);
            BlendAppearance _387 = blend_appearance(param_33, param_34, param_35, param_36);
            a = _387;
            for (uint t = 0u; t < terms; t++)
            {
                uint plane = (t * constants.count) + row;
                uint param_37 = (at_1 + 5u) + t;
                float param_38 = Sh_1._data[plane];
                float param_39 = weight_1;
                float param_40 = blend_value(param_37);
                Sh_1._data[plane] = blend_sh(param_38, param_39, param_40);
            }
        }
    }
    Splats_1._data[row] = vec4(g.mean, a.opacity_logit);
    Splats_1._data[constants.count + row] = g.quat_wxyz;
    Splats_1._data[(2u * constants.count) + row] = vec4(1.0, 0.0, 0.0, a.log_scale.x);
    Splats_1._data[(3u * constants.count) + row] = vec4(0.0, 1.0, 0.0, a.log_scale.y);
    Splats_1._data[(4u * constants.count) + row] = vec4(0.0, 0.0, 1.0, a.log_scale.z);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _blend(param);
}

