#version 310 es
// Generated from hlsl/bind_vertices.hlsl, entry bind_vertices, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

struct Rows4
{
    vec4 row0;
    vec4 row1;
    vec4 row2;
};

layout(binding = 0, std430) readonly buffer SurfaceStatic
{
    uint _data[];
} SurfaceStatic_1;

layout(binding = 8, std140) uniform BindVerticesConstants
{
    uint vertices;
    uint triangles;
    uint vertex_triangle_ptr;
    uint vertex_triangle;
    uint vertex_triangle_width;
    float normal_floor;
    float quaternion_floor;
    uint rotation_rule;
    uint skin_ptr;
    uint skin_column;
    uint skin_column_width;
    uint skin_weight;
    uint skin_weight_width;
    uint skin_weight_step;
    uint joints;
} constants;

layout(binding = 2, std430) readonly buffer Pose
{
    float _data[];
} Pose_1;

layout(binding = 1, std430) readonly buffer Triangles
{
    vec4 _data[];
} Triangles_1;

layout(binding = 3, std430) buffer Mesh
{
    vec4 _data[];
} Mesh_1;

uint packed_element(uint word, uint bit, uint width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

uint surface_code(uint section, uint index, uint width)
{
    if (width == 32u)
    {
        return SurfaceStatic_1._data[section + index];
    }
    uint bit = index * width;
    uint param = SurfaceStatic_1._data[section + (bit >> uint(5))];
    uint param_1 = bit;
    uint param_2 = width;
    return packed_element(param, param_1, param_2);
}

vec3 vertex_normal(vec3 sum_across, float normal_floor)
{
    return sum_across / vec3(max(length(sum_across), normal_floor));
}

Rows4 skin_none()
{
    Rows4 sum;
    sum.row0 = vec4(0.0);
    sum.row1 = vec4(0.0);
    sum.row2 = vec4(0.0);
    return sum;
}

float surface_weight(uint section, uint index, uint width, uint _step)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = surface_code(param, param_1, param_2);
    if (width == 32u)
    {
        return uintBitsToFloat(code);
    }
    return uintBitsToFloat(SurfaceStatic_1._data[_step]) * float(code);
}

Rows4 vertex_joint(uint joint)
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

Rows4 vertex_skin_matrix(uint row)
{
    Rows4 blended = skin_none();
    uint end = SurfaceStatic_1._data[(constants.skin_ptr + row) + 1u];
    uint _308 = constants.skin_ptr + row;
    for (uint e = SurfaceStatic_1._data[_308]; e < end; e++)
    {
        uint param = constants.skin_weight;
        uint param_1 = e;
        uint param_2 = constants.skin_weight_width;
        uint param_3 = constants.skin_weight_step;
        float weight = surface_weight(param, param_1, param_2, param_3);
        uint param_4 = constants.skin_column;
        uint param_5 = e;
        uint param_6 = constants.skin_column_width;
        uint param_7 = surface_code(param_4, param_5, param_6);
        Rows4 param_8 = blended;
        float param_9 = weight;
        Rows4 param_10 = vertex_joint(param_7);
        Rows4 _353 = skin_add(param_8, param_9, param_10);
        blended = _353;
    }
    return blended;
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
    uint _386 = constants.vertex_triangle_ptr + row;
    for (uint e = SurfaceStatic_1._data[_386]; e < end; e++)
    {
        uint param = constants.vertex_triangle;
        uint param_1 = e;
        uint param_2 = constants.vertex_triangle_width;
        uint t = surface_code(param, param_1, param_2);
        float canonical_size = Triangles_1._data[(2u * constants.triangles) + t].x;
        across += Triangles_1._data[t].xyz;
        turn += (Triangles_1._data[constants.triangles + t] * canonical_size);
        area += canonical_size;
    }
    vec3 param_3 = across;
    float param_4 = constants.normal_floor;
    Mesh_1._data[constants.vertices + row] = vec4(vertex_normal(param_3, param_4), 0.0);
    if (constants.rotation_rule == 3u)
    {
        uint param_5 = row;
        Rows4 blended = vertex_skin_matrix(param_5);
        Mesh_1._data[(2u * constants.vertices) + row] = blended.row0;
        Mesh_1._data[(3u * constants.vertices) + row] = blended.row1;
        Mesh_1._data[(4u * constants.vertices) + row] = blended.row2;
    }
    else
    {
        if (constants.rotation_rule == 1u)
        {
            vec4 param_6 = turn;
            float param_7 = area;
            Mesh_1._data[(2u * constants.vertices) + row] = vertex_quat_mean(param_6, param_7);
        }
        else
        {
            vec4 param_8 = turn;
            float param_9 = constants.quaternion_floor;
            Mesh_1._data[(2u * constants.vertices) + row] = vertex_quat(param_8, param_9);
        }
    }
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _bind_vertices(param);
}

