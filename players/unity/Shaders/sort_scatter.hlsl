// Copy of avatar_shaders/hlsl/sort_scatter.hlsl, by `python -m avatar_shaders`; do not edit.
// Stage `sort`, each pass, one group a block: moves pairs to their places. Equal digits keep their order.
// Reads: Pairs, Counts. Writes: PairsOut.
#include "platform_core.hlsl"
#include "sort_core.hlsl"

StructuredBuffer<uint2> Pairs; // [count]: key, id
StructuredBuffer<uint> Counts; // [16, groups]: place of the block's first pair of a digit
RWStructuredBuffer<uint2> PairsOut; // [count]

AVATAR_CONSTANTS(SortScatterConstants)
    uint count;
    uint groups;
    uint shift; // 0, 4 .. 28
AVATAR_CONSTANTS_END

groupshared uint places[AVATAR_SORT_DIGITS * AVATAR_THREADS]; // [digit, thread]

[numthreads(AVATAR_THREADS, 1, 1)]
void sort_scatter(uint3 group : SV_GroupID, uint3 thread : SV_GroupThreadID)
{
    uint lane = thread.x;
    // A thread takes consecutive pairs, so the order of the threads is the order of the pairs.
    uint begin = min(group.x * AVATAR_SORT_BLOCK + lane * AVATAR_SORT_ITEMS, count);
    uint end = min(begin + AVATAR_SORT_ITEMS, count);
    for (uint d = 0; d < AVATAR_SORT_DIGITS; ++d)
    {
        places[d * AVATAR_THREADS + lane] = 0;
    }
    for (uint i = begin; i < end; ++i)
    {
        places[sort_digit(Pairs[i].x, shift) * AVATAR_THREADS + lane] += 1;
    }
    GroupMemoryBarrierWithGroupSync();
    if (lane < AVATAR_SORT_DIGITS)
    {
        uint place = Counts[lane * groups + group.x];
        for (uint other = 0; other < AVATAR_THREADS; ++other)
        {
            uint at = lane * AVATAR_THREADS + other;
            uint own = places[at];
            places[at] = place;
            place += own;
        }
    }
    GroupMemoryBarrierWithGroupSync();
    for (uint j = begin; j < end; ++j)
    {
        uint2 pair = Pairs[j];
        uint at = sort_digit(pair.x, shift) * AVATAR_THREADS + lane;
        PairsOut[places[at]] = pair;
        places[at] += 1;
    }
}
