// Copy of players/native/src/formats/gzip.cpp by `python -m avatar_shaders`; do not edit.
#include "gzip.h"

#include <initializer_list>

#include "crc32.h"
#include "deflate.h"

namespace avatar {

static constexpr size_t head_bytes = 10, tail_bytes = 8;  // of a gzip file; the tail is checksum and length
static constexpr size_t first_piece = 1 << 16;  // bytes of memory that are taken ahead of the data
static constexpr size_t most_ahead = 4;         // later, as often as there are bytes in the file
static constexpr uint32_t end_of_block = 256;

namespace {

struct FixedCodes {
    Huffman literals;
    Huffman distances;

    FixedCodes() {
        uint8_t lengths[Huffman::most_symbols];
        for (uint32_t i = 0; i < 288; i++) lengths[i] = i < 144 ? 8 : i < 256 ? 9 : i < 280 ? 7 : 8;
        literals.make(lengths, 288, HuffmanUse::literals, false);
        std::memset(lengths, 5, 32);
        distances.make(lengths, 32, HuffmanUse::distances, false);
    }
};

}  // namespace

static uint32_t u32_at(const uint8_t* bytes) {
    return static_cast<uint32_t>(bytes[0]) | static_cast<uint32_t>(bytes[1]) << 8 | static_cast<uint32_t>(bytes[2]) << 16 |
           static_cast<uint32_t>(bytes[3]) << 24;
}

Gzip::Gzip(const uint8_t* file, size_t size, const AvatarAllocator& allocator, Errors& errors)
    : file_(file), size_(size), bytes_(allocator, errors) {
    bits_ = BitReader(file, size, body_of());
}

bool Gzip::fail(const char* why) {
    if (wrong == nullptr) wrong = why;
    return false;
}

/// Where the data begins, behind the header.
size_t Gzip::body_of() {
    const unsigned has_checksum = 2, has_extra = 4, reserved = 0xe0;
    if (size_ < head_bytes) return fail(cut_off) ? 0 : size_;
    const unsigned flags = file_[3];
    if (file_[2] != 8 || (flags & reserved) != 0) return fail("an unknown kind of gzip") ? 0 : size_;
    size_t at = head_bytes;
    if ((flags & has_extra) != 0) at += size_ < at + 2 ? 2 : 2u + file_[at] + 256u * file_[at + 1];
    for (const unsigned text : {8u, 16u}) {  // a name, a comment
        if ((flags & text) == 0) continue;
        while (at < size_ && file_[at] != 0) at++;
        at++;
    }
    if ((flags & has_checksum) != 0) at += 2;
    if (at > size_) return fail(cut_off) ? 0 : size_;
    if ((flags & has_checksum) != 0) {
        const uint32_t said = file_[at - 2] + 256u * file_[at - 1];
        if (said != (crc32(file_, at - 2) & 0xffff)) fail("the checksum of its header differs");
    }
    return at;
}

bool Gzip::inflate(size_t length) {
    while (length_ < length && wrong == nullptr) {
        bool going = true;
        if (state_ == State::last) return false;
        if (state_ == State::between) going = open_block();
        else if (state_ == State::stored) going = copy_stored(length);
        else going = inflate_symbols(length);
        if (!going) return false;
    }
    return wrong == nullptr;
}

void Gzip::check_end() {
    if (inflate(length_ + 1)) fail("it is longer than it says");
    if (wrong != nullptr) return;
    const size_t tail = bits_.position();
    if (size_ - tail < tail_bytes) fail(cut_off);
    else if (size_ - tail > tail_bytes) fail("other bytes follow");
    else if (u32_at(file_ + tail) != crc32(bytes_.data(), length_) ||
             u32_at(file_ + tail + 4) != static_cast<uint32_t>(length_)) {
        fail("its checksum differs");
    }
}

bool Gzip::open_block() {
    if (is_last_) {
        state_ = State::last;
        return false;
    }
    const int32_t last = bits_.take(1), kind = bits_.take(2);
    if (last < 0 || kind < 0) return fail(cut_off);
    is_last_ = last == 1;
    if (kind == 3) return fail("an unknown kind of block");
    if (kind == 0) return open_stored();
    state_ = State::coded;
    if (kind == 2) return read_codes();
    static const FixedCodes fixed;
    literals_ = &fixed.literals;
    distances_ = &fixed.distances;
    return true;
}

bool Gzip::open_stored() {
    size_t at = bits_.position();
    if (size_ - at < 4) return fail(cut_off);
    stored_ = file_[at] + 256u * file_[at + 1];
    if ((file_[at + 2] + 256u * file_[at + 3]) != (~stored_ & 0xffff)) return fail("a stored block is damaged");
    bits_.set_position(at + 4);
    state_ = stored_ > 0 ? State::stored : State::between;
    return true;
}

bool Gzip::copy_stored(size_t length) {
    size_t count = stored_ < length - length_ ? stored_ : length - length_;
    const size_t at = bits_.position();
    if (count > size_ - at) return fail(cut_off);
    if (!reserve(count, length)) return false;
    std::memcpy(bytes_.data() + length_, file_ + at, count);
    bits_.set_position(at + count);
    length_ += count;
    stored_ -= count;
    if (stored_ == 0) state_ = State::between;
    return true;
}

bool Gzip::read_codes() {
    static const uint8_t order[] = {16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15};
    const int32_t literals = bits_.take(5), distances = bits_.take(5), count = bits_.take(4);
    if (literals < 0 || distances < 0 || count < 0) return fail(cut_off);
    const uint32_t literal_count = static_cast<uint32_t>(literals) + 257, distance_count = static_cast<uint32_t>(distances) + 1;
    if (literal_count > 286 || distance_count > 30) return fail("too many codes");
    uint8_t short_lengths[19] = {}, lengths[286 + 30] = {};
    for (int32_t i = 0; i < count + 4; i++) {
        const int32_t length = bits_.take(3);
        if (length < 0) return fail(cut_off);
        short_lengths[order[i]] = static_cast<uint8_t>(length);
    }
    Huffman of_lengths;
    const char* why = of_lengths.make(short_lengths, 19, HuffmanUse::code_lengths, false);
    if (why != nullptr) return fail(why);
    if (!read_lengths(of_lengths, lengths, literal_count + distance_count)) return false;
    if (lengths[end_of_block] == 0) return fail("a block has no end");
    literals_ = &own_literals_;
    distances_ = &own_distances_;
    why = own_literals_.make(lengths, literal_count, HuffmanUse::literals, true);
    if (why == nullptr) why = own_distances_.make(lengths + literal_count, distance_count, HuffmanUse::distances, true);
    return why == nullptr || fail(why);
}

bool Gzip::read_lengths(const Huffman& of_lengths, uint8_t* lengths, uint32_t count) {
    for (uint32_t i = 0; i < count;) {
        bits_.fill();
        const HuffmanSymbol read = of_lengths.read(bits_.held());
        const uint32_t symbol = read.value();
        if (!bits_.skip(read.bits())) return fail(cut_off);
        int32_t times = 1;
        if (symbol == 16) times = 3 + bits_.take(2);
        if (symbol == 17) times = 3 + bits_.take(3);
        if (symbol == 18) times = 11 + bits_.take(7);
        if (symbol >= 16 && times < (symbol == 18 ? 11 : 3)) return fail(cut_off);
        const uint32_t end = i + static_cast<uint32_t>(times);
        if (end > count || (symbol == 16 && i == 0)) return fail("damaged codes");
        const uint8_t length = symbol < 16 ? static_cast<uint8_t>(symbol) : symbol == 16 ? lengths[i - 1] : uint8_t{0};
        while (i < end) lengths[i++] = length;
    }
    return true;
}

bool Gzip::inflate_symbols(size_t length) {
    while (length_ < length && state_ == State::coded) {
        if (!reserve(Deflated::slack, length + Deflated::slack)) return false;
        const size_t room = bytes_.capacity() - Deflated::slack;
        Deflated out = {bytes_.data(), length_, length < room + 1 ? length : room + 1};
        BitReader bits = bits_;  // own copies, which stay in registers while bytes are written
        const char* why = nullptr;
        const bool ended = inflate_symbols_of(*literals_, *distances_, bits, out, &why);
        bits_ = bits;
        length_ = out.length;
        if (why != nullptr) return fail(why);
        if (ended) state_ = State::between;
    }
    return true;
}

/// Makes room for `more` bytes; for all that are wanted, if the file may well hold them.
bool Gzip::reserve(size_t more, size_t wanted) {
    if (bytes_.capacity() - length_ >= more) return true;
    bytes_.set_size(length_);
    const size_t least = length_ + more, ahead = length_ + (size_ > first_piece ? most_ahead * size_ : first_piece);
    if (wanted > ahead) wanted = ahead;
    return bytes_.reserve(wanted > least ? wanted : least);
}

}  // namespace avatar
