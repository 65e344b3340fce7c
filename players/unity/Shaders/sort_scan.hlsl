// Copy of avatar_shaders/hlsl/sort_scan.hlsl, by `python -m avatar_shaders`; do not edit.
// Stage `sort`, each pass, one group in all: replaces each count by the place of the block's first pair of the digit.
// Reads: nothing. Writes: Counts.
#include "platform_core.hlsl"
#include "sort_core.hlsl"

RWStructuredBuffer<uint> Counts; // [16, groups], digit by digit

AVATAR_CONSTANTS(SortScanConstants)
    uint total; // 16 groups
AVATAR_CONSTANTS_END

groupshared uint sums[AVATAR_SORT_SCAN_THREADS];

[numthreads(AVATAR_SORT_SCAN_THREADS, 1, 1)]
void sort_scan(uint3 thread : SV_GroupThreadID)
{
    uint lane = thread.x;
    uint share = (total + AVATAR_SORT_SCAN_THREADS - 1) / AVATAR_SORT_SCAN_THREADS;
    uint begin = min(lane * share, total), end = min(begin + share, total);
    uint sum = 0;
    for (uint i = begin; i < end; ++i)
    {
        sum += Counts[i];
    }
    sums[lane] = sum;
    GroupMemoryBarrierWithGroupSync();
    if (lane == 0)
    {
        uint before = 0;
        for (uint other = 0; other < AVATAR_SORT_SCAN_THREADS; ++other)
        {
            uint own = sums[other];
            sums[other] = before;
            before += own;
        }
    }
    GroupMemoryBarrierWithGroupSync();
    uint place = sums[lane];
    for (uint j = begin; j < end; ++j)
    {
        uint own = Counts[j];
        Counts[j] = place;
        place += own;
    }
}
