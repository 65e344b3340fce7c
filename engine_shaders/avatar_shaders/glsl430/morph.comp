#version 430
// Generated from hlsl/morph.hlsl, entry morph, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

layout(binding = 0, std430) readonly buffer MorphStatic
{
    uint _data[];
} MorphStatic_1;

layout(binding = 1, std430) readonly buffer Pose
{
    float _data[];
} Pose_1;

layout(binding = 8, std140) uniform MorphConstants
{
    uint first;
    uint count;
    uint vertices;
    uint template_plane;
    uint morph_ptr;
    uint morph_entry;
    uint corrective_ptr;
    uint corrective_entry;
    uint weights;
    uint features;
} constants;

layout(binding = 2, std430) buffer Mesh
{
    vec4 _data[];
} Mesh_1;

vec3 morph_add(vec3 position, float weight, vec3 delta)
{
    return position + (delta * weight);
}

vec3 morph_sum(inout vec3 position, uint row, uint ptr, uint entry, uint pose)
{
    uint end = MorphStatic_1._data[(ptr + row) + 1u];
    uint _57 = ptr + row;
    for (uint e = MorphStatic_1._data[_57]; e < end; e++)
    {
        uint at = entry + (4u * e);
        float weight = Pose_1._data[pose + MorphStatic_1._data[at]];
        if (weight != 0.0)
        {
            vec3 delta = vec3(uintBitsToFloat(MorphStatic_1._data[at + 1u]), uintBitsToFloat(MorphStatic_1._data[at + 2u]), uintBitsToFloat(MorphStatic_1._data[at + 3u]));
            vec3 param = position;
            float param_1 = weight;
            vec3 param_2 = delta;
            position = morph_add(param, param_1, param_2);
        }
    }
    return position;
}

void _morph(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    uint at = constants.template_plane + row;
    vec3 position = vec3(uintBitsToFloat(MorphStatic_1._data[at]), uintBitsToFloat(MorphStatic_1._data[at + constants.count]), uintBitsToFloat(MorphStatic_1._data[at + (2u * constants.count)]));
    vec3 param = position;
    uint param_1 = row;
    uint param_2 = constants.morph_ptr;
    uint param_3 = constants.morph_entry;
    uint param_4 = constants.weights;
    vec3 _182 = morph_sum(param, param_1, param_2, param_3, param_4);
    position = _182;
    vec3 param_5 = position;
    uint param_6 = row;
    uint param_7 = constants.corrective_ptr;
    uint param_8 = constants.corrective_entry;
    uint param_9 = constants.features;
    vec3 _199 = morph_sum(param_5, param_6, param_7, param_8, param_9);
    position = _199;
    Mesh_1._data[constants.first + row] = vec4(position, 1.0);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _morph(param);
}

