// Stage `shadow`, last step, one thread a Gaussian: the least distance from the first light, at the texels where its
// alpha, seen from the light, is large.
// Reads: Splats. Writes: Shadow.
#include "platform.hlsli"
#include "light.hlsli"

StructuredBuffer<float4> Splats; // [5 count]: mean and opacity; quaternion; 3 rows of sh_rotation with scale in w
AVATAR_LEAST_BUFFER(Shadow); // [AVATAR_SHADOW_SIZE^2] bits of the least distance

AVATAR_CONSTANTS(ShadowConstants)
    float4 shadow_row0; // column, row, distance and w of the shadow map from world
    float4 shadow_row1;
    float4 shadow_row2;
    float4 shadow_row3;
    uint count;
AVATAR_CONSTANTS_END

[numthreads(AVATAR_THREADS, 1, 1)]
void shadow(uint3 id : SV_DispatchThreadID)
{
    uint row = id.x;
    if (row >= count)
    {
        return;
    }
    float4 mean = Splats[row];
    ShadowPoint p = shadow_point(mean.xyz, shadow_row0, shadow_row1, shadow_row2, shadow_row3);
    float most = 2 * log(max(mean.w, 1e-30) / AVATAR_SHADOW_ALPHA);
    // Gradients of column and row.
    float3 across = (shadow_row0.xyz - p.texel.x * shadow_row3.xyz) * p.scale;
    float3 down = (shadow_row1.xyz - p.texel.y * shadow_row3.xyz) * p.scale;
    float3 scale = float3(Splats[2 * count + row].w, Splats[3 * count + row].w, Splats[4 * count + row].w);
    Rows3 turn = matrix_from_quat(Splats[count + row]);
    float3 u = rotate_inverse(turn, across) * scale, v = rotate_inverse(turn, down) * scale;
    float xx = dot(u, u) + AVATAR_SHADOW_LOW_PASS, xy = dot(u, v), yy = dot(v, v) + AVATAR_SHADOW_LOW_PASS;
    float det = xx * yy - xy * xy;
    if (!(most > 0) || !(p.distance > 0) || !(det > 0))
    {
        return;
    }
    // A flat splat that the light grazes is nearer on one side: its mean distance there, by column and row.
    float3 away = rotate_inverse(turn, shadow_row2.xyz) * scale;
    float away_x = dot(away, u), away_y = dot(away, v);
    float2 slope = float2(yy * away_x - xy * away_y, xx * away_y - xy * away_x) / det;
    float2 reach = min(sqrt(most * float2(xx, yy)), SHADOW_REACH);
    float last = AVATAR_SHADOW_SIZE - 1;
    float2 low = clamp(ceil(p.texel - reach), 0.0, last + 1), high = clamp(floor(p.texel + reach), -1.0, last);
    for (float y = low.y; y <= high.y; y += 1)
    {
        for (float x = low.x; x <= high.x; x += 1)
        {
            float2 d = float2(x, y) - p.texel;
            if (d.x * (yy * d.x - 2 * xy * d.y) + xx * d.y * d.y <= most * det)
            {
                float distance = max(p.distance + dot(slope, d), 0.0);
                AVATAR_LEAST(Shadow, uint(y) * AVATAR_SHADOW_SIZE + uint(x), asuint(distance));
            }
        }
    }
}
