// Generated from hlsl/shadow_mesh.hlsl, entry shadow_mesh, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"
#pragma clang diagnostic ignored "-Wunused-variable"

#include <metal_stdlib>
#include <simd/simd.h>
#include <metal_atomic>

using namespace metal;

struct Rows4
{
    float4 row0;
    float4 row1;
    float4 row2;
};

struct ShadowPoint
{
    float2 texel;
    float _distance;
    float scale;
};

struct CornerStatic
{
    uint _data[1];
};

struct ShadowMeshConstants
{
    uint triangles;
    uint vertices;
    uint corners;
    uint corners_width;
    float4 world_row0;
    float4 world_row1;
    float4 world_row2;
    float4 shadow_row0;
    float4 shadow_row1;
    float4 shadow_row2;
    float4 shadow_row3;
};

struct Mesh
{
    float4 _data[1];
};

struct Shadow
{
    uint _data[1];
};

static inline __attribute__((always_inline))
uint packed_element(thread const uint& word, thread const uint& bit, thread const uint& width)
{
    return (word >> (bit & 31u)) & ((1u << width) - 1u);
}

static inline __attribute__((always_inline))
uint corner_code(thread const uint& section, thread const uint& index, thread const uint& width, const device CornerStatic& CornerStatic_1)
{
    if (width == 32u)
    {
        return CornerStatic_1._data[section + index];
    }
    uint bit = index * width;
    uint param = CornerStatic_1._data[section + (bit >> uint(5))];
    uint param_1 = bit;
    uint param_2 = width;
    return packed_element(param, param_1, param_2);
}

static inline __attribute__((always_inline))
float3 transform_point(thread const Rows4& m, thread const float3& p)
{
    return float3((((m.row0.x * p.x) + (m.row0.y * p.y)) + (m.row0.z * p.z)) + m.row0.w, (((m.row1.x * p.x) + (m.row1.y * p.y)) + (m.row1.z * p.z)) + m.row1.w, (((m.row2.x * p.x) + (m.row2.y * p.y)) + (m.row2.z * p.z)) + m.row2.w);
}

static inline __attribute__((always_inline))
ShadowPoint shadow_point(thread const float3& x, thread const float4& row0, thread const float4& row1, thread const float4& row2, thread const float4& row3)
{
    float4 at = float4(x, 1.0);
    ShadowPoint p;
    p.scale = 1.0 / dot(row3, at);
    p.texel = float2(dot(row0, at), dot(row1, at)) * p.scale;
    p._distance = dot(row2, at);
    return p;
}

static inline __attribute__((always_inline))
ShadowPoint shadow_corner(thread const uint& at, const device CornerStatic& CornerStatic_1, constant ShadowMeshConstants& constants, const device Mesh& Mesh_1)
{
    Rows4 world;
    world.row0 = constants.world_row0;
    world.row1 = constants.world_row1;
    world.row2 = constants.world_row2;
    uint param = constants.corners;
    uint param_1 = at;
    uint param_2 = constants.corners_width;
    Rows4 param_3 = world;
    float3 param_4 = Mesh_1._data[corner_code(param, param_1, param_2, CornerStatic_1)].xyz;
    float3 x = transform_point(param_3, param_4);
    float3 param_5 = x;
    float4 param_6 = constants.shadow_row0;
    float4 param_7 = constants.shadow_row1;
    float4 param_8 = constants.shadow_row2;
    float4 param_9 = constants.shadow_row3;
    return shadow_point(param_5, param_6, param_7, param_8, param_9);
}

static inline __attribute__((always_inline))
float shadow_side(thread const float2& from, thread const float2& to, thread const float2& at)
{
    return ((to.x - from.x) * (at.y - from.y)) - ((to.y - from.y) * (at.x - from.x));
}

static inline __attribute__((always_inline))
void _shadow_mesh(thread const uint3& id, const device CornerStatic& CornerStatic_1, constant ShadowMeshConstants& constants, const device Mesh& Mesh_1, device Shadow& Shadow_1)
{
    uint t = id.x;
    if (t >= constants.triangles)
    {
        return;
    }
    uint param = t;
    ShadowPoint a = shadow_corner(param, CornerStatic_1, constants, Mesh_1);
    uint param_1 = constants.triangles + t;
    ShadowPoint b = shadow_corner(param_1, CornerStatic_1, constants, Mesh_1);
    uint param_2 = (2u * constants.triangles) + t;
    ShadowPoint c = shadow_corner(param_2, CornerStatic_1, constants, Mesh_1);
    float2 param_3 = a.texel;
    float2 param_4 = b.texel;
    float2 param_5 = c.texel;
    float area = shadow_side(param_3, param_4, param_5);
    if ((!(fast::min(a._distance, fast::min(b._distance, c._distance)) > 0.0)) || (!(abs(area) > 0.0)))
    {
        return;
    }
    float last = 255.0;
    float2 low = fast::clamp(ceil(fast::min(a.texel, fast::min(b.texel, c.texel))), float2(0.0), float2(last + 1.0));
    float2 high = fast::clamp(floor(fast::max(a.texel, fast::max(b.texel, c.texel))), float2(-1.0), fast::min(low + float2(128.0), float2(last)));
    for (float y = low.y; y <= high.y; y += 1.0)
    {
        for (float x = low.x; x <= high.x; x += 1.0)
        {
            float2 at = float2(x, y);
            float2 param_6 = b.texel;
            float2 param_7 = c.texel;
            float2 param_8 = at;
            float u = shadow_side(param_6, param_7, param_8) / area;
            float2 param_9 = c.texel;
            float2 param_10 = a.texel;
            float2 param_11 = at;
            float v = shadow_side(param_9, param_10, param_11) / area;
            float2 param_12 = a.texel;
            float2 param_13 = b.texel;
            float2 param_14 = at;
            float w = shadow_side(param_12, param_13, param_14) / area;
            if (fast::min(u, fast::min(v, w)) >= 0.0)
            {
                float _distance = ((u * a._distance) + (v * b._distance)) + (w * c._distance);
                uint _490 = atomic_fetch_min_explicit((device atomic_uint*)&Shadow_1._data[(uint(y) * 256u) + uint(x)], as_type<uint>(_distance), memory_order_relaxed);
            }
        }
    }
}

kernel void shadow_mesh(const device CornerStatic& CornerStatic_1 [[buffer(0)]], const device Mesh& Mesh_1 [[buffer(1)]], device Shadow& Shadow_1 [[buffer(2)]], constant ShadowMeshConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _shadow_mesh(param, CornerStatic_1, constants, Mesh_1, Shadow_1);
}

