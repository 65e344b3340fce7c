// Copy of avatar_shaders/hlsl/packed.hlsli, by `python -m avatar_shaders`; do not edit.
// Small integers in a packed buffer of 32-bit words, and the numbers that they stand for.
// Reads: nothing. Writes: nothing.
//
// A section begins at a word. Its elements are 8, 16 or 32 bits wide and follow each other, the first in the lowest
// bits of its word. Width 32 holds a float32 or an integer as it is. Width 0 stores nothing: every code is 0.
#ifndef AVATAR_PACKED_HLSLI
#define AVATAR_PACKED_HLSLI

// The element in `word` that begins at bit `bit` of its section.
uint packed_element(uint word, uint bit, uint width)
{
    return (word >> (bit & 31)) & ((1u << width) - 1);
}

// The number on both sides of 0 that a code counts: half of the codes are negative.
float packed_step_count(uint code, uint width)
{
    return (float)code - (float)(1u << (width - 1));
}

// Functions of one buffer of words. `scale`, `step` and `table` are words that hold float32.
//   NAME_code(section, index, width)            the element itself
//   NAME_linear(section, index, width, scale)   low + step * code; at `scale`: low, then step
//   NAME_signed(section, index, width, step)    step * (code - half of the codes)
//   NAME_weight(section, index, width, step)    step * code
//   NAME_table(section, index, width, table)    the float32 of that code
#define AVATAR_PACKED(NAME, BUFFER) \
    uint NAME##_code(uint section, uint index, uint width) \
    { \
        if (width == 32) \
        { \
            return BUFFER[section + index]; \
        } \
        uint bit = index * width; \
        return packed_element(BUFFER[section + (bit >> 5)], bit, width); \
    } \
    float NAME##_linear(uint section, uint index, uint width, uint scale) \
    { \
        uint code = NAME##_code(section, index, width); \
        if (width == 32) \
        { \
            return asfloat(code); \
        } \
        return asfloat(BUFFER[scale]) + asfloat(BUFFER[scale + 1]) * (float)code; \
    } \
    float NAME##_signed(uint section, uint index, uint width, uint step) \
    { \
        if (width == 0) \
        { \
            return 0; \
        } \
        uint code = NAME##_code(section, index, width); \
        if (width == 32) \
        { \
            return asfloat(code); \
        } \
        return asfloat(BUFFER[step]) * packed_step_count(code, width); \
    } \
    float NAME##_weight(uint section, uint index, uint width, uint step) \
    { \
        uint code = NAME##_code(section, index, width); \
        if (width == 32) \
        { \
            return asfloat(code); \
        } \
        return asfloat(BUFFER[step]) * (float)code; \
    } \
    float NAME##_table(uint section, uint index, uint width, uint table) \
    { \
        uint code = NAME##_code(section, index, width); \
        if (width == 32) \
        { \
            return asfloat(code); \
        } \
        return asfloat(BUFFER[table + code]); \
    } \
    float3 NAME##_linear3(uint section, uint index, uint stride, uint width, uint scale) \
    { \
        return float3( \
            NAME##_linear(section, index, width, scale), \
            NAME##_linear(section, index + stride, width, scale + 2), \
            NAME##_linear(section, index + 2 * stride, width, scale + 4)); \
    } \
    float3 NAME##_signed3(uint section, uint index, uint width, uint step) \
    { \
        return float3( \
            NAME##_signed(section, index, width, step), \
            NAME##_signed(section, index + 1, width, step + 1), \
            NAME##_signed(section, index + 2, width, step + 2)); \
    }

#endif
