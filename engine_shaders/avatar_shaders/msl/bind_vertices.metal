// Generated from hlsl/bind_vertices.hlsl, entry bind_vertices, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct Rows4
{
    float4 row0;
    float4 row1;
    float4 row2;
};

struct SurfaceStatic
{
    uint _data[1];
};

struct BindVerticesConstants
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
};

struct Pose
{
    float _data[1];
};

struct Triangles
{
    float4 _data[1];
};

struct Mesh
{
    float4 _data[1];
};

static inline __attribute__((always_inline))
uint packed_element(thread const uint& word, thread const uint& bit, thread const uint& width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

static inline __attribute__((always_inline))
uint surface_code(thread const uint& section, thread const uint& index, thread const uint& width, const device SurfaceStatic& SurfaceStatic_1)
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

static inline __attribute__((always_inline))
float3 vertex_normal(thread const float3& sum_across, thread const float& normal_floor)
{
    return sum_across / float3(fast::max(length(sum_across), normal_floor));
}

static inline __attribute__((always_inline))
Rows4 skin_none()
{
    Rows4 sum;
    sum.row0 = float4(0.0);
    sum.row1 = float4(0.0);
    sum.row2 = float4(0.0);
    return sum;
}

static inline __attribute__((always_inline))
float surface_weight(thread const uint& section, thread const uint& index, thread const uint& width, thread const uint& _step, const device SurfaceStatic& SurfaceStatic_1)
{
    uint param = section;
    uint param_1 = index;
    uint param_2 = width;
    uint code = surface_code(param, param_1, param_2, SurfaceStatic_1);
    if (width == 32u)
    {
        return as_type<float>(code);
    }
    return as_type<float>(SurfaceStatic_1._data[_step]) * float(code);
}

static inline __attribute__((always_inline))
Rows4 vertex_joint(thread const uint& joint, constant BindVerticesConstants& constants, const device Pose& Pose_1)
{
    uint at = constants.joints + (12u * joint);
    Rows4 m;
    m.row0 = float4(Pose_1._data[at], Pose_1._data[at + 1u], Pose_1._data[at + 2u], Pose_1._data[at + 3u]);
    m.row1 = float4(Pose_1._data[at + 4u], Pose_1._data[at + 5u], Pose_1._data[at + 6u], Pose_1._data[at + 7u]);
    m.row2 = float4(Pose_1._data[at + 8u], Pose_1._data[at + 9u], Pose_1._data[at + 10u], Pose_1._data[at + 11u]);
    return m;
}

static inline __attribute__((always_inline))
Rows4 skin_add(thread Rows4& sum, thread const float& weight, thread const Rows4& joint)
{
    sum.row0 += (joint.row0 * weight);
    sum.row1 += (joint.row1 * weight);
    sum.row2 += (joint.row2 * weight);
    return sum;
}

static inline __attribute__((always_inline))
Rows4 vertex_skin_matrix(thread const uint& row, const device SurfaceStatic& SurfaceStatic_1, constant BindVerticesConstants& constants, const device Pose& Pose_1)
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
        float weight = surface_weight(param, param_1, param_2, param_3, SurfaceStatic_1);
        uint param_4 = constants.skin_column;
        uint param_5 = e;
        uint param_6 = constants.skin_column_width;
        uint param_7 = surface_code(param_4, param_5, param_6, SurfaceStatic_1);
        Rows4 param_8 = blended;
        float param_9 = weight;
        Rows4 param_10 = vertex_joint(param_7, constants, Pose_1);
        Rows4 _353 = skin_add(param_8, param_9, param_10);
        blended = _353;
    }
    return blended;
}

static inline __attribute__((always_inline))
float4 vertex_quat_mean(thread const float4& sum_turn, thread const float& sum_area)
{
    return sum_turn / float4(fast::max(sum_area, 1.0000000031710768509710513471353e-30));
}

static inline __attribute__((always_inline))
float4 vertex_quat(thread const float4& sum_turn, thread const float& quaternion_floor)
{
    return sum_turn / float4(fast::max(sqrt(dot(sum_turn, sum_turn)), quaternion_floor));
}

static inline __attribute__((always_inline))
void _bind_vertices(thread const uint3& id, const device SurfaceStatic& SurfaceStatic_1, constant BindVerticesConstants& constants, const device Pose& Pose_1, const device Triangles& Triangles_1, device Mesh& Mesh_1)
{
    uint row = id.x;
    if (row >= constants.vertices)
    {
        return;
    }
    float3 across = float3(0.0);
    float4 turn = float4(0.0);
    float area = 0.0;
    uint end = SurfaceStatic_1._data[(constants.vertex_triangle_ptr + row) + 1u];
    uint _386 = constants.vertex_triangle_ptr + row;
    for (uint e = SurfaceStatic_1._data[_386]; e < end; e++)
    {
        uint param = constants.vertex_triangle;
        uint param_1 = e;
        uint param_2 = constants.vertex_triangle_width;
        uint t = surface_code(param, param_1, param_2, SurfaceStatic_1);
        float canonical_size = ((device float*)&Triangles_1._data[(2u * constants.triangles) + t])[0u];
        across += Triangles_1._data[t].xyz;
        turn += (Triangles_1._data[constants.triangles + t] * canonical_size);
        area += canonical_size;
    }
    float3 param_3 = across;
    float param_4 = constants.normal_floor;
    Mesh_1._data[constants.vertices + row] = float4(vertex_normal(param_3, param_4), 0.0);
    if (constants.rotation_rule == 3u)
    {
        uint param_5 = row;
        Rows4 blended = vertex_skin_matrix(param_5, SurfaceStatic_1, constants, Pose_1);
        Mesh_1._data[(2u * constants.vertices) + row] = blended.row0;
        Mesh_1._data[(3u * constants.vertices) + row] = blended.row1;
        Mesh_1._data[(4u * constants.vertices) + row] = blended.row2;
    }
    else
    {
        if (constants.rotation_rule == 1u)
        {
            float4 param_6 = turn;
            float param_7 = area;
            Mesh_1._data[(2u * constants.vertices) + row] = vertex_quat_mean(param_6, param_7);
        }
        else
        {
            float4 param_8 = turn;
            float param_9 = constants.quaternion_floor;
            Mesh_1._data[(2u * constants.vertices) + row] = vertex_quat(param_8, param_9);
        }
    }
}

kernel void bind_vertices(const device SurfaceStatic& SurfaceStatic_1 [[buffer(0)]], const device Triangles& Triangles_1 [[buffer(1)]], const device Pose& Pose_1 [[buffer(2)]], device Mesh& Mesh_1 [[buffer(3)]], constant BindVerticesConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _bind_vertices(param, SurfaceStatic_1, constants, Pose_1, Triangles_1, Mesh_1);
}

