// Copy of avatar_shaders/hlsl/sort.hlsli, by `python -m avatar_shaders`; do not edit.
// Core of stage `sort`: keys and digits of a stable radix sort by (view z, id).
// Reads: nothing. Writes: nothing.
//
// 8 passes of 4 bits, lowest digit first. The view z of a drawn splat is positive, so
// its bits have the order of its value.
#ifndef AVATAR_SORT_HLSLI
#define AVATAR_SORT_HLSLI

#define AVATAR_SORT_DIGITS 16 // values of a digit
#define AVATAR_SORT_ITEMS 16 // pairs of a thread
#define AVATAR_SORT_BLOCK (AVATAR_THREADS * AVATAR_SORT_ITEMS) // pairs of a block, which a group sorts
#define AVATAR_SORT_SCAN_THREADS 128 // threads of the one group of sort_scan

static const uint AVATAR_NOT_DRAWN = 0xFFFFFFFFu;

uint sort_key(float depth, float radius)
{
    return radius > 0 ? asuint(depth) : AVATAR_NOT_DRAWN;
}

uint sort_digit(uint key, uint shift)
{
    return (key >> shift) & (AVATAR_SORT_DIGITS - 1);
}

#endif
