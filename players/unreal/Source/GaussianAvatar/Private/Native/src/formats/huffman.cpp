// Copy of players/native/src/formats/huffman.cpp by `python -m avatar_shaders`; do not edit.
#include "huffman.h"

namespace avatar {

static uint32_t literal(uint32_t symbol) {
    static const uint16_t base[] = {3,  4,  5,  6,  7,  8,  9,  10, 11,  13,  15,  17,  19,  23, 27,
                                    31, 35, 43, 51, 59, 67, 83, 99, 115, 131, 163, 195, 227, 258};
    if (symbol < 256) return HuffmanSymbol::letter | symbol << 16;
    if (symbol == 256) return HuffmanSymbol::end;
    const uint32_t code = symbol - 257;
    if (code > 28) return HuffmanSymbol::unknown;
    const uint32_t extra = code < 8 || code == 28 ? 0 : (code - 4) / 4;
    return extra << 4 | static_cast<uint32_t>(base[code]) << 16;
}

static uint32_t distance(uint32_t symbol) {
    static const uint16_t base[] = {1,   2,   3,   4,   5,   7,    9,    13,   17,   25,   33,   49,   65,    97,    129,
                                    193, 257, 385, 513, 769, 1025, 1537, 2049, 3073, 4097, 6145, 8193, 12289, 16385, 24577};
    if (symbol > 29) return HuffmanSymbol::unknown;
    const uint32_t extra = symbol < 4 ? 0 : (symbol - 2) / 2;
    return extra << 4 | static_cast<uint32_t>(base[symbol]) << 16;
}

/// What a table holds for a symbol, the length of its code aside.
static uint32_t entry_of(uint32_t symbol, HuffmanUse use) {
    if (use == HuffmanUse::literals) return literal(symbol);
    return use == HuffmanUse::distances ? distance(symbol) : HuffmanSymbol::letter | symbol << 16;
}

const char* Huffman::make(const uint8_t* lengths, uint32_t count, HuffmanUse use, bool may_be_alone) {
    uint32_t counts[most_bits + 1] = {};
    for (uint32_t i = 0; i < count; i++) counts[lengths[i]]++;
    const uint32_t used = count - counts[0];
    int64_t left = 1;
    for (uint32_t length = 1; length <= most_bits; length++) {
        left = 2 * left - counts[length];
        if (left < 0) return "a code is ambiguous";
    }
    const bool alone = may_be_alone && used <= 1 && counts[1] == used;
    if (left > 0 && !alone) return "a code has gaps";
    if (left > 0) std::memset(table_, 0, sizeof(uint32_t) << first_bits);
    assign(lengths, count, use, counts);
    return nullptr;
}

/// The lowest bits of a code in the order in which they are read.
static uint32_t reversed(uint32_t code, uint32_t bits) {
    code = (code & 0x5555u) << 1 | (code >> 1 & 0x5555u);
    code = (code & 0x3333u) << 2 | (code >> 2 & 0x3333u);
    code = (code & 0x0f0fu) << 4 | (code >> 4 & 0x0f0fu);
    return ((code & 0xffu) << 8 | code >> 8) >> (16 - bits);
}

void Huffman::assign(const uint8_t* lengths, uint32_t count, HuffmanUse use, const uint32_t* counts) {
    uint32_t codes[most_bits + 2] = {}, places[most_bits + 2] = {};  // the next ones of each length
    for (uint32_t length = 1; length <= most_bits; length++) {
        codes[length + 1] = (codes[length] + counts[length]) << 1;
        places[length + 1] = places[length] + counts[length];
    }
    struct Long {
        uint16_t symbol, code;
        uint32_t length;
    } longs[most_symbols];  // in the order of their codes
    const uint32_t before = places[first_bits + 1];
    for (uint32_t symbol = 0; symbol < count; symbol++) {
        const uint32_t length = lengths[symbol];
        if (length == 0) continue;
        const uint32_t code = reversed(codes[length]++, length);
        if (length > first_bits) {
            longs[places[length]++ - before] = {static_cast<uint16_t>(symbol), static_cast<uint16_t>(code), length};
            continue;
        }
        const uint32_t entry = entry_of(symbol, use) | length;
        for (uint32_t at = code; at < 1u << first_bits; at += 1u << length) table_[at] = entry;
    }
    // Codes that begin with the same bits follow each other, the longest one last.
    uint32_t next = 1u << first_bits;
    const uint32_t long_count = places[most_bits + 1] - before, mask = next - 1;
    for (uint32_t first = 0, last; first < long_count; first = last) {
        const uint32_t begin = longs[first].code & mask;
        for (last = first + 1; last < long_count && (longs[last].code & mask) == begin; last++) {}
        const uint32_t bits = longs[last - 1].length - first_bits;
        table_[begin] = HuffmanSymbol::more | bits | next << 16;
        for (uint32_t i = first; i < last; i++) {
            const uint32_t entry = entry_of(longs[i].symbol, use) | longs[i].length, step = 1u << (longs[i].length - first_bits);
            for (uint32_t at = longs[i].code >> first_bits; at < 1u << bits; at += step) table_[next + at] = entry;
        }
        next += 1u << bits;
    }
}

}  // namespace avatar
