// How libFuzzer changes packs: bytes of the header or of tensors, after which the lengths and checksums around them are
// right again; sometimes bytes of the file as they come. Changes by the structure of JSON are made by tools/fuzz/readers.py.
#include <cstring>

#include "../src/formats/crc32.h"
#include "../src/formats/gzip.h"

// Inputs are made here, not judged: no sanitizer slows it down, and no coverage is counted.
#pragma clang attribute push(__attribute__((no_sanitize("address", "undefined", "coverage"))), apply_to = function)

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t most);

namespace {

constexpr size_t most_body = size_t{1} << 20, length_bytes = 8, gzip_head = 10, gzip_tail = 8, most_piece = 4096;

uint8_t piece[2 * most_piece];  // bytes on their way

/// Changes some bytes from a place up to `end`, whose number may change; what is behind them moves. Gives the new size.
size_t change_piece(uint8_t* bytes, size_t size, size_t most, size_t from, size_t end, unsigned seed) {
    if (from < end) from += (seed >> 4) % (end - from);
    const size_t left = end - from, reach = size_t{1} << (seed >> 16) % 12, length = left < reach ? left : reach;
    std::memcpy(piece, bytes + from, length);
    const size_t room = most - size, changed = LLVMFuzzerMutate(piece, length, length + (room < 64 ? room : 64));
    std::memmove(bytes + from + changed, bytes + from + length, size - from - length);
    std::memcpy(bytes + from, piece, changed);
    return size - length + changed;
}

/// Changes a body once. Its header's length is right afterwards, unless that is what was changed.
size_t change_body(uint8_t* bytes, size_t size, size_t most, unsigned seed) {
    uint64_t length = 0;
    if (size > length_bytes) std::memcpy(&length, bytes, length_bytes);
    if (size <= length_bytes || length > size - length_bytes || seed % 16 == 0) return LLVMFuzzerMutate(bytes, size, most);
    const size_t header_end = length_bytes + static_cast<size_t>(length);
    if (seed % 4 == 1) return change_piece(bytes, size, most, header_end, size, seed);
    const size_t made = change_piece(bytes, size, most, length_bytes, header_end, seed);
    length += made - size;
    std::memcpy(bytes, &length, length_bytes);
    return made;
}

/// Changes a file once. Mostly the checksum and the length behind it are right afterwards, where it still inflates.
size_t change_file(uint8_t* file, size_t size, size_t most, unsigned seed) {
    size = LLVMFuzzerMutate(file, size, most);
    if (size <= gzip_head + gzip_tail || seed % 4 == 0) return size;
    avatar::Errors errors;
    avatar::Gzip gzip(file, size, avatar::allocator_or_default(nullptr), errors);
    if (gzip.inflate(most_body) || gzip.wrong != nullptr || gzip.length() > most_body) return size;
    const uint32_t tail[] = {avatar::crc32(gzip.bytes(), gzip.length()), static_cast<uint32_t>(gzip.length())};
    std::memcpy(file + size - gzip_tail, tail, gzip_tail);
    return size;
}

}  // namespace

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t most, unsigned seed) {
    const bool is_file = size >= 2 && data[0] == 0x1f && data[1] == 0x8b;
    return is_file ? change_file(data, size, most, seed) : change_body(data, size, most, seed);
}

#pragma clang attribute pop
