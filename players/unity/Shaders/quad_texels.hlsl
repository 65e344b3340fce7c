// Copies quads into a texture, for vertex shaders without storage buffers. One thread a texel.
// Reads: Quads. Writes: QuadTexels.
#include "Packages/com.avatar-export.player/Made/platform_core.hlsl"
#include "Packages/com.avatar-export.player/Made/raster_core.hlsl"

StructuredBuffer<float4> Quads; // [3 quad_count], as raster_gather writes them
RWTexture2D<float4> QuadTexels; // [rows, 3 AVATAR_QUAD_ROW]

AVATAR_CONSTANTS(QuadTexelsConstants)
    uint quad_count; // splats
AVATAR_CONSTANTS_END

[numthreads(AVATAR_THREADS, 1, 1)]
void quad_texels(uint3 id : SV_DispatchThreadID)
{
    uint texel = id.x;
    if (texel < 3 * quad_count)
    {
        QuadTexels[uint2(texel % (3 * AVATAR_QUAD_ROW), texel / (3 * AVATAR_QUAD_ROW))] = Quads[texel];
    }
}
