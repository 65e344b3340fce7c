// Copy of players/native/src/formats/deflate.cpp by `python -m avatar_shaders`; do not edit.
#include "deflate.h"

namespace avatar {

/// Repeats `length` bytes from `distance` before.
static inline void repeat(uint8_t* to, size_t distance, size_t length) {
    const uint8_t* from = to - distance;
    if (distance >= 8) {
        for (size_t at = 0; at < length; at += 8) std::memcpy(to + at, from + at, 8);  // into the slack behind
    } else if (distance == 1) {
        std::memset(to, *from, length);
    } else {
        for (size_t at = 0; at < length; at++) to[at] = from[at];
    }
}

static const char* why_not(HuffmanSymbol symbol, const BitReader& bits, const char* unknown) {
    if (!symbol.is_none()) return unknown;
    return bits.count() < static_cast<int32_t>(Huffman::most_bits) ? cut_off : "a code that means nothing";
}

bool inflate_symbols_of(const Huffman& literals, const Huffman& distances, BitReader& bits, Deflated& out, const char** why) {
    uint8_t* const bytes = out.bytes;
    size_t at = out.length;
    bool ended = false;
    while (at < out.end) {
        bits.fill();  // Bits behind the end of the file are 0. Whether they were needed is seen below.
        HuffmanSymbol symbol = literals.read(bits.held());
        // Three letters take at most 45 of 56 bits, a match at most 48.
        for (int more = 0; more < 3 && symbol.is_letter(); more++) {
            bits.drop(symbol.bits());
            bytes[at++] = static_cast<uint8_t>(symbol.value());
            if (more < 2) symbol = literals.read(bits.held());
        }
        if (bits.count() < 0) break;
        if (symbol.is_letter()) continue;
        bits.fill();
        if (symbol.is_none() || symbol.is_unknown()) {
            *why = why_not(symbol, bits, "an unknown length");
            break;
        }
        bits.drop(symbol.bits());
        if (symbol.is_end()) {
            ended = true;
            break;
        }
        const size_t length = symbol.value() + bits.drop_number(symbol.extra_bits());
        const HuffmanSymbol back = distances.read(bits.held());
        if (back.is_none() || back.is_unknown()) {
            *why = why_not(back, bits, "an unknown distance");
            break;
        }
        bits.drop(back.bits());
        const size_t distance = back.value() + bits.drop_number(back.extra_bits());
        if (bits.count() < 0) break;
        if (distance > at) {
            *why = "a distance leads before the beginning";
            break;
        }
        repeat(bytes + at, distance, length);
        at += length;
    }
    if (bits.count() < 0) *why = cut_off;
    out.length = at;
    return ended && *why == nullptr;
}

}  // namespace avatar
