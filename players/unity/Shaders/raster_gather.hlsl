// Copy of avatar_shaders/hlsl/raster_gather.hlsl, by `python -m avatar_shaders`; do not edit.
// Stage `raster`, first step, one thread an instance: splats in drawing order, for one chunk and one piece.
// Reads: Projected, Pairs. Writes: Quads.
#include "platform_core.hlsl"
#include "sort_core.hlsl"

StructuredBuffer<float4> Projected; // [3 chunk_count]: centre, depth, opacity; conic, radius; rgb, clip depth
StructuredBuffer<uint2> Pairs; // [count] sorted: key, id
RWStructuredBuffer<float4> Quads; // [3 piece_count]: centre, clip depth, opacity; conic, 0; rgb, 0; an instance each 3

AVATAR_CONSTANTS(RasterGatherConstants)
    uint count; // all splats
    uint begin; // the piece's first instance
    uint piece_count;
    uint first; // the chunk's first id
    uint chunk_count;
    uint reverse; // 1: back to front; 0: front to back
AVATAR_CONSTANTS_END

[numthreads(AVATAR_THREADS, 1, 1)]
void raster_gather(uint3 id : SV_DispatchThreadID)
{
    uint instance = id.x;
    if (instance >= piece_count)
    {
        return;
    }
    uint rank = begin + instance;
    uint row = Pairs[reverse != 0 ? count - 1 - rank : rank].y - first;
    if (row >= chunk_count)
    {
        return; // of another chunk
    }
    float4 place = Projected[row], conic = Projected[chunk_count + row], rgb = Projected[2 * chunk_count + row];
    Quads[3 * instance] = float4(place.xy, rgb.w, place.w);
    Quads[3 * instance + 1] = float4(conic.xyz, 0);
    Quads[3 * instance + 2] = float4(rgb.xyz, 0);
}
