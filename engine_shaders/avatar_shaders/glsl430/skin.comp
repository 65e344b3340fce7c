#version 430
// Generated from hlsl/skin.hlsl, entry skin, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

struct Rows4
{
    vec4 row0;
    vec4 row1;
    vec4 row2;
};

layout(binding = 8, std140) uniform SkinConstants
{
    uint first;
    uint count;
    uint late_ptr;
    uint late_entry;
    uint skin_ptr;
    uint skin_entry;
    uint late;
    uint joints;
} constants;

layout(binding = 1, std430) readonly buffer Pose
{
    float _data[];
} Pose_1;

layout(binding = 0, std430) readonly buffer SkinStatic
{
    uint _data[];
} SkinStatic_1;

layout(binding = 2, std430) buffer Mesh
{
    vec4 _data[];
} Mesh_1;

Rows4 skin_none()
{
    Rows4 sum;
    sum.row0 = vec4(0.0);
    sum.row1 = vec4(0.0);
    sum.row2 = vec4(0.0);
    return sum;
}

Rows4 skin_joint(uint joint)
{
    uint at = constants.joints + (12u * joint);
    Rows4 m;
    m.row0 = vec4(Pose_1._data[at], Pose_1._data[at + 1u], Pose_1._data[at + 2u], Pose_1._data[at + 3u]);
    m.row1 = vec4(Pose_1._data[at + 4u], Pose_1._data[at + 5u], Pose_1._data[at + 6u], Pose_1._data[at + 7u]);
    m.row2 = vec4(Pose_1._data[at + 8u], Pose_1._data[at + 9u], Pose_1._data[at + 10u], Pose_1._data[at + 11u]);
    return m;
}

Rows4 skin_add(inout Rows4 sum, float weight, Rows4 joint)
{
    sum.row0 += (joint.row0 * weight);
    sum.row1 += (joint.row1 * weight);
    sum.row2 += (joint.row2 * weight);
    return sum;
}

vec3 transform_point(Rows4 m, vec3 p)
{
    return vec3((((m.row0.x * p.x) + (m.row0.y * p.y)) + (m.row0.z * p.z)) + m.row0.w, (((m.row1.x * p.x) + (m.row1.y * p.y)) + (m.row1.z * p.z)) + m.row1.w, (((m.row2.x * p.x) + (m.row2.y * p.y)) + (m.row2.z * p.z)) + m.row2.w);
}

vec3 late_add(vec3 posed, float weight, vec3 delta)
{
    return posed + (delta * weight);
}

void _skin(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    Rows4 blended = skin_none();
    uint end = SkinStatic_1._data[(constants.skin_ptr + row) + 1u];
    uint _272 = constants.skin_ptr + row;
    for (uint e = SkinStatic_1._data[_272]; e < end; e++)
    {
        uint at = constants.skin_entry + (2u * e);
        uint param = SkinStatic_1._data[at];
        Rows4 param_1 = blended;
        float param_2 = uintBitsToFloat(SkinStatic_1._data[at + 1u]);
        Rows4 param_3 = skin_joint(param);
        Rows4 _304 = skin_add(param_1, param_2, param_3);
        blended = _304;
    }
    Rows4 param_4 = blended;
    vec3 param_5 = Mesh_1._data[constants.first + row].xyz;
    vec3 posed = transform_point(param_4, param_5);
    uint late_end = SkinStatic_1._data[(constants.late_ptr + row) + 1u];
    uint _336 = constants.late_ptr + row;
    for (uint l = SkinStatic_1._data[_336]; l < late_end; l++)
    {
        uint at_1 = constants.late_entry + (4u * l);
        vec3 delta = vec3(uintBitsToFloat(SkinStatic_1._data[at_1 + 1u]), uintBitsToFloat(SkinStatic_1._data[at_1 + 2u]), uintBitsToFloat(SkinStatic_1._data[at_1 + 3u]));
        vec3 param_6 = posed;
        float param_7 = Pose_1._data[constants.late + SkinStatic_1._data[at_1]];
        vec3 param_8 = delta;
        posed = late_add(param_6, param_7, param_8);
    }
    Mesh_1._data[constants.first + row] = vec4(posed, 1.0);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _skin(param);
}

