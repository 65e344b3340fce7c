#pragma once
#include "huffman.h"

namespace avatar {

/// Why a file is not sound whose end is missing.
constexpr const char* cut_off = "it was cut off";

/// Bytes that are inflated, up to `end` or a little more.
struct Deflated {
    static constexpr size_t slack = 258 + 16;  // bytes behind the end: of letters and a match, and the steps of a copy

    uint8_t* bytes;
    size_t length;
    size_t end;
};

/// Inflates symbols of a block until the output is full or the block ends. Returns whether it ended; `why` is what is
/// wrong.
bool inflate_symbols_of(const Huffman& literals, const Huffman& distances, BitReader& bits, Deflated& out, const char** why);

}  // namespace avatar
