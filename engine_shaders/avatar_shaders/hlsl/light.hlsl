// Stage `light`, one thread a Gaussian, after stage `project`: its colour in the light of the scene.
// Reads: LightStatic, Splats, Shadow. Writes: Projected.
#include "platform.hlsli"
#include "packed.hlsli"
#include "light.hlsli"

StructuredBuffer<uint> LightStatic; // sections at the offsets below
StructuredBuffer<float4> Splats; // [5 or 6 count]: mean and opacity; quaternion; 3 rows that are not read; normal
StructuredBuffer<uint> Shadow; // [AVATAR_SHADOW_SIZE^2] bits of the least distance from the first light
RWStructuredBuffer<float4> Projected; // [3 count]: centre, depth, opacity; conic, radius; rgb, clip depth

AVATAR_PACKED(light, LightStatic)

AVATAR_CONSTANTS(LightConstants)
    uint count;
    uint normal; // 3 planes, in the axes of the Gaussian
    uint normal_width;
    uint normal_scale;
    float4 turn_row0; // frame that the light of the capture moves with from world, a rotation
    float4 turn_row1;
    float4 turn_row2;
    float4 capture_ambient0; // rgb, of the light of the capture
    float4 capture_ambient1;
    float4 capture_ambient2;
    float4 capture_ambient3;
    float4 capture_ambient4;
    float4 capture_ambient5;
    float4 capture_ambient6;
    float4 capture_ambient7;
    float4 capture_ambient8;
    float4 scene_ambient0;
    float4 scene_ambient1;
    float4 scene_ambient2;
    float4 scene_ambient3;
    float4 scene_ambient4;
    float4 scene_ambient5;
    float4 scene_ambient6;
    float4 scene_ambient7;
    float4 scene_ambient8;
    float4 place0; // of a light: see light_direct
    float4 place1;
    float4 place2;
    float4 place3;
    float4 colour0; // of a light: rgb
    float4 colour1;
    float4 colour2;
    float4 colour3;
    float4 shadow_row0; // column, row, distance and w of the shadow map from world
    float4 shadow_row1;
    float4 shadow_row2;
    float4 shadow_row3;
    float4 shadow_offset; // along the normal, along the light (both in bundle units), 1 where there is a map, 0
    uint turned; // 1: the last plane of Splats has the normals, which entry light_normals wrote
AVATAR_CONSTANTS_END

// 0 in the shadow, 1 in the light.
float light_seen(float3 x, float3 n)
{
    if (shadow_offset.z == 0)
    {
        return 1;
    }
    ShadowPoint p = shadow_point(x + n * shadow_offset.x, shadow_row0, shadow_row1, shadow_row2, shadow_row3);
    float2 first = floor(p.texel), part = p.texel - first;
    float seen = 0;
    for (uint i = 0; i < 16; ++i)
    {
        float2 at = first + float2(i % 4, i / 4) - 1;
        float last = AVATAR_SHADOW_SIZE - 1;
        bool inside = at.x >= 0 && at.y >= 0 && at.x <= last && at.y <= last;
        uint texel = inside ? uint(at.y) * AVATAR_SHADOW_SIZE + uint(at.x) : 0;
        bool lit = !inside || asfloat(Shadow[texel]) >= p.distance - shadow_offset.y;
        seen += lit ? shadow_weight(i % 4, part.x) * shadow_weight(i / 4, part.y) : 0;
    }
    return seen;
}

float3 light_scene(float3 n, float3 x)
{
    float3 light = light_ambient(
        n, scene_ambient0.xyz, scene_ambient1.xyz, scene_ambient2.xyz, scene_ambient3.xyz, scene_ambient4.xyz,
        scene_ambient5.xyz, scene_ambient6.xyz, scene_ambient7.xyz, scene_ambient8.xyz);
    light += light_direct(n, x, place0, colour0.xyz) * light_seen(x, n);
    light += light_direct(n, x, place1, colour1.xyz);
    light += light_direct(n, x, place2, colour2.xyz);
    return light + light_direct(n, x, place3, colour3.xyz);
}

[numthreads(AVATAR_THREADS, 1, 1)]
void light(uint3 id : SV_DispatchThreadID)
{
    uint row = id.x;
    if (row >= count || !(Projected[count + row].w > 0))
    {
        return;
    }
    float3 n;
    if (turned != 0)
    {
        n = Splats[5 * count + row].xyz;
    }
    else
    {
        n = light_linear3(normal, row, count, normal_width, normal_scale);
        n = rotate(matrix_from_quat(Splats[count + row]), n);
    }
    n = n / max(length(n), 1e-30);
    float3 scene = light_scene(n, Splats[row].xyz);
    float3 captured = float3(dot(turn_row0.xyz, n), dot(turn_row1.xyz, n), dot(turn_row2.xyz, n));
    float3 capture = light_ambient(
        captured, capture_ambient0.xyz, capture_ambient1.xyz, capture_ambient2.xyz,
        capture_ambient3.xyz, capture_ambient4.xyz, capture_ambient5.xyz, capture_ambient6.xyz, capture_ambient7.xyz,
        capture_ambient8.xyz);
    float4 colour = Projected[2 * count + row];
    Projected[2 * count + row] = float4(light_colour(colour.xyz, scene, capture), colour.w);
}
