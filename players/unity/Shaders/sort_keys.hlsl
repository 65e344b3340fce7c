// Copy of avatar_shaders/hlsl/sort_keys.hlsl, by `python -m avatar_shaders`; do not edit.
// Stage `sort`, first step, one thread a splat: the key of the splat and its id among all chunks.
// Reads: Projected. Writes: Pairs.
#include "platform_core.hlsl"
#include "sort_core.hlsl"

StructuredBuffer<float4> Projected; // [3 count]: centre, depth, opacity; conic, radius; rgb, clip depth
RWStructuredBuffer<uint2> Pairs; // [all splats]: key, id

AVATAR_CONSTANTS(SortKeysConstants)
    uint count;
    uint first; // id of the chunk's first splat
AVATAR_CONSTANTS_END

[numthreads(AVATAR_THREADS, 1, 1)]
void sort_keys(uint3 id : SV_DispatchThreadID)
{
    uint row = id.x;
    if (row >= count)
    {
        return;
    }
    Pairs[first + row] = uint2(sort_key(Projected[row].z, Projected[count + row].w), first + row);
}
