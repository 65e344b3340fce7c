// Copy of avatar_shaders/hlsl/sort_count.hlsl, by `python -m avatar_shaders`; do not edit.
// Stage `sort`, each pass, one group a block: counts each digit in the block.
// Reads: Pairs. Writes: Counts.
#include "platform_core.hlsl"
#include "sort_core.hlsl"

StructuredBuffer<uint2> Pairs; // [count]: key, id
RWStructuredBuffer<uint> Counts; // [16, groups]

AVATAR_CONSTANTS(SortCountConstants)
    uint count;
    uint groups;
    uint shift; // 0, 4 .. 28
AVATAR_CONSTANTS_END

AVATAR_GROUP_COUNTERS(occurrences, AVATAR_SORT_DIGITS);

[numthreads(AVATAR_THREADS, 1, 1)]
void sort_count(uint3 group : SV_GroupID, uint3 thread : SV_GroupThreadID)
{
    uint lane = thread.x;
    if (lane < AVATAR_SORT_DIGITS)
    {
        AVATAR_COUNTER_CLEAR(occurrences[lane]);
    }
    GroupMemoryBarrierWithGroupSync();
    for (uint i = 0; i < AVATAR_SORT_ITEMS; ++i)
    {
        uint at = group.x * AVATAR_SORT_BLOCK + i * AVATAR_THREADS + lane;
        if (at < count)
        {
            AVATAR_COUNTER_INCREMENT(occurrences[sort_digit(Pairs[at].x, shift)]);
        }
    }
    GroupMemoryBarrierWithGroupSync();
    if (lane < AVATAR_SORT_DIGITS)
    {
        Counts[lane * groups + group.x] = AVATAR_COUNTER(occurrences[lane]);
    }
}
