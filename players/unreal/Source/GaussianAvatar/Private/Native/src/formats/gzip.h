// Copy of players/native/src/formats/gzip.h by `python -m avatar_shaders`; do not edit.
#pragma once
#include "huffman.h"
#include "memory.h"

namespace avatar {

/// Inflates one gzip file piece by piece and checks all of it. Memory grows with what there is, not with what is asked.
class Gzip {
public:
    /// Why it is no sound gzip file; null: nothing is wrong so far. Lack of memory is in `errors` alone.
    const char* wrong = nullptr;

    Gzip(const uint8_t* file, size_t size, const AvatarAllocator& allocator, Errors& errors);

    /// Inflates until there are at least `length` bytes, or the end is reached. It may be a few more. False at the end,
    /// and where something is wrong.
    bool inflate(size_t length);

    /// After all has been inflated: checks that nothing follows, the checksum and the length.
    void check_end();

    const uint8_t* bytes() const { return bytes_.data(); }
    size_t length() const { return length_; }
    /// Hands over what was inflated.
    Grown<uint8_t>& held() { return bytes_; }

private:
    bool fail(const char* why);
    size_t body_of();
    bool open_block();
    bool open_stored();
    bool read_codes();
    bool read_lengths(const Huffman& of_lengths, uint8_t* lengths, uint32_t count);
    bool copy_stored(size_t length);
    bool inflate_symbols(size_t length);
    bool reserve(size_t more, size_t wanted);

    const uint8_t* file_;
    size_t size_;
    BitReader bits_;
    Grown<uint8_t> bytes_;
    size_t length_ = 0;
    enum class State { between, stored, coded, last } state_ = State::between;
    size_t stored_ = 0;  // bytes left of a stored block
    bool is_last_ = false;
    const Huffman* literals_ = nullptr;  // of the block
    const Huffman* distances_ = nullptr;
    Huffman own_literals_;
    Huffman own_distances_;
};

}  // namespace avatar
