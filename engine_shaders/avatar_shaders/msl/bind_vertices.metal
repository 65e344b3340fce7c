// Generated from hlsl/bind_vertices.hlsl, entry bind_vertices, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct BindVerticesConstants
{
    uint vertices;
    uint triangles;
    uint canonical_size;
    uint vertex_triangle_ptr;
    uint vertex_triangle;
    float normal_floor;
    float quaternion_floor;
    uint quaternion_by_area;
};

struct SurfaceStatic
{
    uint _data[1];
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
float3 vertex_normal(thread const float3& sum_across, thread const float& normal_floor)
{
    return sum_across / float3(fast::max(length(sum_across), normal_floor));
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
void _bind_vertices(thread const uint3& id, constant BindVerticesConstants& constants, const device SurfaceStatic& SurfaceStatic_1, const device Triangles& Triangles_1, device Mesh& Mesh_1)
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
    uint _104 = constants.vertex_triangle_ptr + row;
    for (uint e = SurfaceStatic_1._data[_104]; e < end; e++)
    {
        uint t = SurfaceStatic_1._data[constants.vertex_triangle + e];
        across += Triangles_1._data[t].xyz;
        turn += (Triangles_1._data[constants.triangles + t] * as_type<float>(SurfaceStatic_1._data[constants.canonical_size + t]));
        area += as_type<float>(SurfaceStatic_1._data[constants.canonical_size + t]);
    }
    float3 param = across;
    float param_1 = constants.normal_floor;
    Mesh_1._data[constants.vertices + row] = float4(vertex_normal(param, param_1), 0.0);
    if (constants.quaternion_by_area != 0u)
    {
        float4 param_2 = turn;
        float param_3 = area;
        Mesh_1._data[(2u * constants.vertices) + row] = vertex_quat_mean(param_2, param_3);
    }
    else
    {
        float4 param_4 = turn;
        float param_5 = constants.quaternion_floor;
        Mesh_1._data[(2u * constants.vertices) + row] = vertex_quat(param_4, param_5);
    }
}

kernel void bind_vertices(const device SurfaceStatic& SurfaceStatic_1 [[buffer(0)]], const device Triangles& Triangles_1 [[buffer(1)]], device Mesh& Mesh_1 [[buffer(2)]], constant BindVerticesConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _bind_vertices(param, constants, SurfaceStatic_1, Triangles_1, Mesh_1);
}

