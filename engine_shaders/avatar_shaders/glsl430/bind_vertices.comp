#version 430
// Generated from hlsl/bind_vertices.hlsl, entry bind_vertices, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

layout(binding = 8, std140) uniform BindVerticesConstants
{
    uint vertices;
    uint triangles;
    uint canonical_size;
    uint vertex_triangle_ptr;
    uint vertex_triangle;
    float normal_floor;
    float quaternion_floor;
    uint quaternion_by_area;
} constants;

layout(binding = 0, std430) readonly buffer SurfaceStatic
{
    uint _data[];
} SurfaceStatic_1;

layout(binding = 1, std430) readonly buffer Triangles
{
    vec4 _data[];
} Triangles_1;

layout(binding = 2, std430) buffer Mesh
{
    vec4 _data[];
} Mesh_1;

vec3 vertex_normal(vec3 sum_across, float normal_floor)
{
    return sum_across / vec3(max(length(sum_across), normal_floor));
}

vec4 vertex_quat_mean(vec4 sum_turn, float sum_area)
{
    return sum_turn / vec4(max(sum_area, 1.0000000031710768509710513471353e-30));
}

vec4 vertex_quat(vec4 sum_turn, float quaternion_floor)
{
    return sum_turn / vec4(max(sqrt(dot(sum_turn, sum_turn)), quaternion_floor));
}

void _bind_vertices(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.vertices)
    {
        return;
    }
    vec3 across = vec3(0.0);
    vec4 turn = vec4(0.0);
    float area = 0.0;
    uint end = SurfaceStatic_1._data[(constants.vertex_triangle_ptr + row) + 1u];
    uint _104 = constants.vertex_triangle_ptr + row;
    for (uint e = SurfaceStatic_1._data[_104]; e < end; e++)
    {
        uint t = SurfaceStatic_1._data[constants.vertex_triangle + e];
        across += Triangles_1._data[t].xyz;
        turn += (Triangles_1._data[constants.triangles + t] * uintBitsToFloat(SurfaceStatic_1._data[constants.canonical_size + t]));
        area += uintBitsToFloat(SurfaceStatic_1._data[constants.canonical_size + t]);
    }
    vec3 param = across;
    float param_1 = constants.normal_floor;
    Mesh_1._data[constants.vertices + row] = vec4(vertex_normal(param, param_1), 0.0);
    if (constants.quaternion_by_area != 0u)
    {
        vec4 param_2 = turn;
        float param_3 = area;
        Mesh_1._data[(2u * constants.vertices) + row] = vertex_quat_mean(param_2, param_3);
    }
    else
    {
        vec4 param_4 = turn;
        float param_5 = constants.quaternion_floor;
        Mesh_1._data[(2u * constants.vertices) + row] = vertex_quat(param_4, param_5);
    }
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _bind_vertices(param);
}

