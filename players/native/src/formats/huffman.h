#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace avatar {

/// Reads bytes bit by bit, the lowest bit of a byte first. Bits behind the end are 0, and going over them is an error.
class BitReader {
public:
    BitReader() = default;
    BitReader(const uint8_t* file, size_t size, size_t begin) : file_(file), size_(size), next_(begin) {}

    /// Holds at least 56 bits, unless the file ends.
    void fill() {
        if (size_ - next_ >= 8) {
            uint64_t more;
            std::memcpy(&more, file_ + next_, sizeof(more));  // hosts are little-endian: see CMakeLists.txt
            held_ |= more << count_;
            next_ += static_cast<size_t>(63 - count_) >> 3;
            count_ |= 56;
            return;
        }
        while (count_ <= 56 && next_ < size_) {
            held_ |= static_cast<uint64_t>(file_[next_++]) << count_;
            count_ += 8;
        }
    }

    uint64_t held() const { return held_; }
    /// How many are held. Below 0: more were dropped than the file has.
    int32_t count() const { return count_; }

    /// Goes on by some bits, below 64, maybe over the end.
    void drop(uint32_t bits) {
        held_ >>= bits;
        count_ -= static_cast<int32_t>(bits);
    }

    /// The next bits, below 32 and maybe over the end, of which enough are held.
    uint32_t drop_number(uint32_t bits) {
        const uint32_t number = static_cast<uint32_t>(held_) & ((1u << bits) - 1);
        drop(bits);
        return number;
    }

    /// Goes on by some bits, below 64. False at the end of the file.
    bool skip(uint32_t bits) {
        if (static_cast<int32_t>(bits) > count_) return false;
        drop(bits);
        return true;
    }

    /// The next bits, at most 16; -1 at the end of the file.
    int32_t take(uint32_t bits) {
        if (count_ < static_cast<int32_t>(bits)) fill();
        const int32_t taken = static_cast<int32_t>(held_ & ((1u << bits) - 1));
        return skip(bits) ? taken : -1;
    }

    /// The next byte of the file.
    size_t position() {
        drop(static_cast<uint32_t>(count_) & 7);
        next_ -= static_cast<size_t>(count_) / 8;
        held_ = 0;
        count_ = 0;
        return next_;
    }

    /// Goes to a byte of the file.
    void set_position(size_t byte) { next_ = byte; }

private:
    const uint8_t* file_ = nullptr;
    size_t size_ = 0;
    size_t next_ = 0;  // byte
    uint64_t held_ = 0;
    int32_t count_ = 0;  // of held bits
};

/// What the symbols of a code stand for.
enum class HuffmanUse { code_lengths, literals, distances };

/// A symbol as it was decoded: a letter, the end of a block, or the base and the extra bits of a length or a distance.
class HuffmanSymbol {
public:
    explicit HuffmanSymbol(uint32_t entry) : entry_(entry) {}

    uint32_t bits() const { return entry_ & 15; }  // of its code
    uint32_t extra_bits() const { return entry_ >> 4 & 15; }
    uint32_t value() const { return entry_ >> 16; }
    bool is_letter() const { return (entry_ & letter) != 0; }
    bool is_end() const { return (entry_ & end) != 0; }
    bool is_none() const { return (entry_ & 15) == 0; }          // a code that means nothing
    bool is_unknown() const { return (entry_ & unknown) != 0; }  // a symbol that means nothing

    static constexpr uint32_t letter = 1 << 8, end = 1 << 9, unknown = 1 << 10, more = 1 << 11;

private:
    uint32_t entry_;
};

/// A Huffman code of deflate as a table of its first bits; longer codes go on in a second table.
class Huffman {
public:
    static constexpr uint32_t most_bits = 15, first_bits = 10, most_symbols = 288;

    /// The code of `count` lengths. Returns null, or why there is none; one symbol may be alone where `may_be_alone`.
    const char* make(const uint8_t* lengths, uint32_t count, HuffmanUse use, bool may_be_alone);

    /// The next symbol of at least 15 held bits.
    HuffmanSymbol read(uint64_t held) const {
        uint32_t entry = table_[held & ((1u << first_bits) - 1)];
        if ((entry & HuffmanSymbol::more) != 0) {
            entry = table_[(entry >> 16) + (held >> first_bits & ((1u << (entry & 15)) - 1))];
        }
        return HuffmanSymbol(entry);
    }

private:
    // A second table of 2^k entries has k + 1 codes or more, and k is at most 5.
    static constexpr uint32_t most_entries = (1 << first_bits) + 32 * most_symbols / 6;

    void assign(const uint8_t* lengths, uint32_t count, HuffmanUse use, const uint32_t* counts);

    // code length | extra bits << 4 | kind | value << 16; or the bits and the place of a second table, and `more`.
    uint32_t table_[most_entries];
};

}  // namespace avatar
