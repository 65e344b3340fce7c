// Stage `shadow`, second step, one thread a triangle of the rig: the least distance from the first light, at the texels
// whose centres it covers.
// Reads: CornerStatic, Mesh. Writes: Shadow.
#include "platform.hlsli"
#include "packed.hlsli"
#include "light.hlsli"

StructuredBuffer<uint> CornerStatic; // sections at the offsets below
StructuredBuffer<float4> Mesh; // [vertices and more]: positions are read
AVATAR_LEAST_BUFFER(Shadow); // [AVATAR_SHADOW_SIZE^2] bits of the least distance

AVATAR_PACKED(corner, CornerStatic)

AVATAR_CONSTANTS(ShadowMeshConstants)
    uint triangles;
    uint vertices;
    uint corners; // 3 planes
    uint corners_width;
    float4 world_row0; // world from avatar, rigid
    float4 world_row1;
    float4 world_row2;
    float4 shadow_row0; // column, row, distance and w of the shadow map from world
    float4 shadow_row1;
    float4 shadow_row2;
    float4 shadow_row3;
AVATAR_CONSTANTS_END

ShadowPoint shadow_corner(uint at)
{
    Rows4 world;
    world.row0 = world_row0;
    world.row1 = world_row1;
    world.row2 = world_row2;
    float3 x = transform_point(world, Mesh[corner_code(corners, at, corners_width)].xyz);
    return shadow_point(x, shadow_row0, shadow_row1, shadow_row2, shadow_row3);
}

float shadow_side(float2 from, float2 to, float2 at)
{
    return (to.x - from.x) * (at.y - from.y) - (to.y - from.y) * (at.x - from.x);
}

[numthreads(AVATAR_THREADS, 1, 1)]
void shadow_mesh(uint3 id : SV_DispatchThreadID)
{
    uint t = id.x;
    if (t >= triangles)
    {
        return;
    }
    ShadowPoint a = shadow_corner(t), b = shadow_corner(triangles + t), c = shadow_corner(2 * triangles + t);
    float area = shadow_side(a.texel, b.texel, c.texel);
    if (!(min(a.distance, min(b.distance, c.distance)) > 0) || !(abs(area) > 0))
    {
        return;
    }
    float last = AVATAR_SHADOW_SIZE - 1;
    float2 low = clamp(ceil(min(a.texel, min(b.texel, c.texel))), 0.0, last + 1);
    float2 high = clamp(floor(max(a.texel, max(b.texel, c.texel))), -1.0, min(low + SHADOW_SPAN, last));
    for (float y = low.y; y <= high.y; y += 1)
    {
        for (float x = low.x; x <= high.x; x += 1)
        {
            float2 at = float2(x, y);
            float u = shadow_side(b.texel, c.texel, at) / area, v = shadow_side(c.texel, a.texel, at) / area;
            float w = shadow_side(a.texel, b.texel, at) / area;
            if (min(u, min(v, w)) >= 0)
            {
                float distance = u * a.distance + v * b.distance + w * c.distance;
                AVATAR_LEAST(Shadow, uint(y) * AVATAR_SHADOW_SIZE + uint(x), asuint(distance));
            }
        }
    }
}
