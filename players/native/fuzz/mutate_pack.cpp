// How libFuzzer changes packs: by their structure. A value of the header or of the document, or bytes of tensors, and
// then the lengths and checksums around them are right again; sometimes bytes of the file as they come.
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "../src/formats/crc32.h"
#include "../src/formats/gzip.h"

// Inputs are made here, not judged: no sanitizer slows it down, and no coverage is counted.
#pragma clang attribute push(__attribute__((no_sanitize("address", "undefined", "coverage"))), apply_to = function)

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t most);

namespace {

constexpr size_t most_body = size_t{1} << 20, length_bytes = 8, gzip_head = 10, gzip_tail = 8, most_stored = 65535;

/// Numbers by chance, as the fuzzer seeds them.
struct Chance {
    uint64_t state;

    uint32_t below(size_t count) {
        state += 0x9e3779b97f4a7c15u;
        uint64_t mixed = (state ^ (state >> 30)) * 0xbf58476d1ce4e5b9u;
        mixed = (mixed ^ (mixed >> 27)) * 0x94d049bb133111ebu;
        return count == 0 ? 0 : static_cast<uint32_t>((mixed >> 32) % count);
    }
};

/// A body that is changed in place.
struct Body {
    uint8_t* bytes;
    size_t size;
    size_t most;

    /// Replaces bytes; the text behind moves. Nothing happens where there is no room.
    void splice(size_t begin, size_t end, const void* with, size_t length) {
        if (size - (end - begin) + length > most) return;
        std::memmove(bytes + begin + length, bytes + end, size - end);
        std::memcpy(bytes + begin, with, length);
        size = size - (end - begin) + length;
    }
};

/// A value or a key of a JSON text, by its place.
struct JsonSpan {
    uint32_t begin, end;  // quotes and brackets included
    uint32_t member;      // where the member begins: at its key, or at the value itself
    char kind;            // its first letter; key, number and word stand for themselves
};

constexpr char key = 'k', number = '0', word = 'w';

/// The values and keys of a text in the order of their ends. Damaged texts give what is found.
struct JsonSpans {
    static constexpr size_t most = 8192, most_open = 64;

    JsonSpan items[most];
    size_t count = 0;

    /// Reads bytes `at` to `end`. `escaped`: the text is itself inside of a JSON string, so that a quote is \" there.
    void scan(const uint8_t* bytes, size_t at, size_t end, bool escaped) {
        JsonSpan open[most_open];
        const size_t quote = escaped ? 2 : 1;
        size_t depth = 0, member = SIZE_MAX;  // where the member of the next value begins
        const auto is_quote = [&](size_t i) {
            return escaped ? i + 1 < end && bytes[i] == '\\' && bytes[i + 1] == '"' : bytes[i] == '"';
        };
        const auto made = [&](size_t begin, size_t behind, char kind) {
            const size_t from = member == SIZE_MAX ? begin : member;
            member = SIZE_MAX;
            return JsonSpan{static_cast<uint32_t>(begin), static_cast<uint32_t>(behind), static_cast<uint32_t>(from), kind};
        };
        const auto add = [&](JsonSpan one) {
            if (count < most) items[count++] = one;
        };
        for (count = 0; at < end;) {
            const size_t begin = at;
            const char letter = static_cast<char>(bytes[at]);
            if (is_quote(at)) {
                for (at += quote; at < end && !is_quote(at);) {
                    if (bytes[at] != '\\') at++;
                    else if (!escaped || at + 2 >= end || bytes[at + 1] != '\\') at += 2;
                    else at += bytes[at + 2] == '\\' || is_quote(at + 2) ? 4 : 3;
                }
                at = at + quote < end ? at + quote : end;
                const bool is_key = at < end && bytes[at] == ':';
                add(made(begin, at, is_key ? key : '"'));
                if (is_key) member = begin;
            } else if (letter == '{' || letter == '[') {
                if (depth < most_open) open[depth++] = made(begin, begin, letter);
                at++;
            } else if ((letter == '}' || letter == ']') && depth > 0) {
                JsonSpan closed = open[--depth];
                closed.end = static_cast<uint32_t>(++at);
                add(closed);
            } else {
                while (at < end && (std::isalnum(bytes[at]) != 0 || bytes[at] == '-' || bytes[at] == '.' || bytes[at] == '+')) at++;
                if (at == begin) at++;
                else add(made(begin, at, letter >= 'a' ? word : number));
            }
        }
    }
};

JsonSpans spans;
uint8_t held[most_body];   // a body that was inflated
uint8_t piece[most_body];  // bytes on their way

const char* const numbers[] = {"0", "1", "-1", "2", "3", "7", "8", "16", "32", "64", "255", "256", "65535", "65536", "2147483647",
                               "2147483648", "4294967295", "4294967296", "9007199254740993", "1e300", "1e999", "0.5", "-0.0",
                               "1e-320", "null", "true", "[]", "{}"};

void replace_number(Body& body, const JsonSpan& one, Chance& chance) {
    char text[40];
    if (chance.below(2) == 0) {
        const char* with = numbers[chance.below(sizeof(numbers) / sizeof(numbers[0]))];
        body.splice(one.begin, one.end, with, std::strlen(with));
        return;
    }
    const size_t length = one.end - one.begin;
    if (length >= sizeof(text)) return;
    std::memcpy(text, body.bytes + one.begin, length);
    text[length] = 0;
    const long value = std::strtol(text, nullptr, 10), steps[] = {1, -1, 2, -2, 3, 4, -4, 63, 64, 256, value, -value / 2};
    const long changed = value + steps[chance.below(sizeof(steps) / sizeof(steps[0]))];
    const int written = std::snprintf(text, sizeof(text), "%ld", changed);
    body.splice(one.begin, one.end, text, static_cast<size_t>(written));
}

/// Puts another value or key in a place: mostly one of the same kind.
void copy_other(Body& body, const JsonSpan& one, Chance& chance) {
    const bool any = chance.below(8) == 0;
    for (int tried = 0; tried < 16; tried++) {
        const JsonSpan& other = spans.items[chance.below(spans.count)];
        const size_t length = other.end - other.begin;
        if ((other.kind != one.kind && !any) || length > 4096) continue;
        std::memcpy(piece, body.bytes + other.begin, length);
        body.splice(one.begin, one.end, piece, length);
        return;
    }
}

/// Takes a member or an entry away, with one comma beside it.
void remove(Body& body, const JsonSpan& one) {
    size_t begin = one.member, end = one.end;
    if (end < body.size && body.bytes[end] == ',') end++;
    else if (begin > 0 && body.bytes[begin - 1] == ',') begin--;
    body.splice(begin, end, "", 0);
}

void repeat(Body& body, const JsonSpan& one) {
    const size_t length = one.end - one.member;
    if (length >= 4096) return;
    piece[0] = ',';
    std::memcpy(piece + 1, body.bytes + one.member, length);
    body.splice(one.end, one.end, piece, length + 1);
}

/// Bytes inside of a value, as libFuzzer changes bytes.
void change_letters(Body& body, const JsonSpan& one, Chance& chance) {
    size_t begin = one.begin, length = one.end - one.begin;
    if (length > 64) begin += chance.below(length - 64), length = 64;
    std::memcpy(piece, body.bytes + begin, length);
    const size_t changed = LLVMFuzzerMutate(piece, length, length + 16);
    body.splice(begin, begin + length, piece, changed);
}

void nest(Body& body, const JsonSpan& one, Chance& chance) {
    const size_t deep = chance.below(4) == 0 ? 200 : 1;
    std::memset(piece, ']', deep);
    body.splice(one.end, one.end, piece, deep);
    std::memset(piece, '[', deep);
    body.splice(one.begin, one.begin, piece, deep);
}

void change_json(Body& body, size_t begin, size_t end, bool escaped, Chance& chance) {
    spans.scan(body.bytes, begin, end, escaped);
    if (spans.count == 0) return;
    const JsonSpan one = spans.items[chance.below(spans.count)];
    const uint32_t what = chance.below(16);
    if (what == 0) nest(body, one, chance);
    else if (what < 3) change_letters(body, one, chance);
    else if (what < 6 && one.kind != key) remove(body, one);
    else if (what < 8 && one.kind != key) repeat(body, one);
    else if (one.kind == number && what < 14) replace_number(body, one, chance);
    else copy_other(body, one, chance);
}

/// Bytes of tensors: an edge of a number format, or what libFuzzer makes of a few.
void change_tensors(Body& body, size_t begin, Chance& chance) {
    static const uint32_t edges[] = {0, 1, 0x7f, 0x80, 0xff, 0xffff, 0x7fffffff, 0x80000000, 0xffffffff, 0x7f800000, 0x7fc00000, 0xff7fffff};
    if (begin >= body.size) return;
    const size_t at = begin + chance.below(body.size - begin), room = body.size - at;
    size_t length = size_t{1} << chance.below(chance.below(2) == 0 ? 3 : 7);
    if (length > room) length = room;
    if (length <= 4) {
        std::memcpy(body.bytes + at, &edges[chance.below(sizeof(edges) / sizeof(edges[0]))], length);
    } else {
        std::memcpy(piece, body.bytes + at, length);
        LLVMFuzzerMutate(piece, length, length);
        std::memcpy(body.bytes + at, piece, length);
    }
}

/// The place of the document inside of the header, quotes excluded; an empty one where there is none.
void find_document(const Body& body, size_t end, size_t* from, size_t* to) {
    static const char name[] = "\"pack\":";
    *from = *to = 0;
    for (size_t at = length_bytes; at + sizeof(name) < end && *from == 0; at++) {
        if (std::memcmp(body.bytes + at, name, sizeof(name) - 1) != 0) continue;
        *from = at + sizeof(name) - 1;
        while (*from < end && body.bytes[*from] != '"') ++*from;
        ++*from;
    }
    for (*to = *from; *to < end && body.bytes[*to] != '"'; ++*to) {
        if (body.bytes[*to] == '\\') ++*to;
    }
    if (*to > end) *to = end;
}

/// Changes a body once. Its header's length is right afterwards, unless that is what was changed.
size_t change_body(uint8_t* bytes, size_t size, size_t most, Chance& chance) {
    uint64_t length = 0;
    if (size > length_bytes) std::memcpy(&length, bytes, length_bytes);
    if (size <= length_bytes || length > size - length_bytes || chance.below(16) == 0) return LLVMFuzzerMutate(bytes, size, most);
    Body body = {bytes, size, most};
    const size_t header_end = length_bytes + static_cast<size_t>(length);
    const uint32_t what = chance.below(8);
    if (what < 2) {
        change_tensors(body, header_end, chance);
    } else if (what == 2) {
        change_json(body, length_bytes, header_end, false, chance);
    } else {
        size_t from = 0, to = 0;
        find_document(body, header_end, &from, &to);
        change_json(body, from, to, true, chance);
    }
    const uint64_t grown = length + body.size - size;
    std::memcpy(body.bytes, &grown, length_bytes);
    return body.size;
}

/// Writes the checksum and the length of what a file inflates to behind it.
void seal(uint8_t* file, size_t size, const uint8_t* body, size_t length) {
    const uint32_t tail[] = {avatar::crc32(body, length), static_cast<uint32_t>(length)};
    std::memcpy(file + size - gzip_tail, tail, gzip_tail);
}

/// A gzip file of stored blocks; 0 where there is no room.
size_t wrap(const uint8_t* body, size_t length, uint8_t* file, size_t most) {
    const size_t blocks = length / most_stored + 1;
    if (gzip_head + 5 * blocks + length + gzip_tail > most) return 0;
    static const uint8_t head[gzip_head] = {0x1f, 0x8b, 8};
    std::memcpy(file, head, gzip_head);
    size_t to = gzip_head;
    for (size_t block = 0, from = 0; block < blocks; block++) {
        const size_t left = length - from, count = left < most_stored ? left : most_stored;
        const uint8_t lengths[] = {block + 1 == blocks, static_cast<uint8_t>(count), static_cast<uint8_t>(count >> 8),
                                   static_cast<uint8_t>(~count), static_cast<uint8_t>(~count >> 8)};
        std::memcpy(file + to, lengths, sizeof(lengths));
        std::memcpy(file + to + sizeof(lengths), body + from, count);
        to += sizeof(lengths) + count;
        from += count;
    }
    seal(file, to + gzip_tail, body, length);
    return to + gzip_tail;
}

/// What a file inflates to, into `held`; 0 where it is damaged or large.
size_t unwrap(const uint8_t* file, size_t size) {
    avatar::Errors errors;
    avatar::Gzip gzip(file, size, avatar::allocator_or_default(nullptr), errors);
    if (gzip.inflate(most_body) || gzip.wrong != nullptr || gzip.length() > most_body) return 0;
    std::memcpy(held, gzip.bytes(), gzip.length());
    return gzip.length();
}

size_t change_file(uint8_t* file, size_t size, size_t most, Chance& chance) {
    if (chance.below(4) > 0) {
        size = LLVMFuzzerMutate(file, size, most);
        const size_t length = size > gzip_head + gzip_tail && chance.below(4) > 0 ? unwrap(file, size) : 0;
        if (length > 0) seal(file, size, held, length);
        return size;
    }
    const size_t length = unwrap(file, size);
    const size_t made = length == 0 ? 0 : wrap(held, change_body(held, length, most_body, chance), file, most);
    return made > 0 ? made : LLVMFuzzerMutate(file, size, most);
}

}  // namespace

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t most, unsigned seed) {
    Chance chance = {seed};
    const bool is_file = size >= 2 && data[0] == 0x1f && data[1] == 0x8b;
    return is_file ? change_file(data, size, most, chance) : change_body(data, size, most, chance);
}

#pragma clang attribute pop
