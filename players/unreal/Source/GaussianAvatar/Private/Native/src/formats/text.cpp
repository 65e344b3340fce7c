// Copy of players/native/src/formats/text.cpp by `python -m avatar_shaders`; do not edit.
#include "text.h"

#include <clocale>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>

namespace avatar {

bool text_before(Text a, Text b) {
    const uint32_t shared = a.size < b.size ? a.size : b.size;
    const int order = shared == 0 ? 0 : std::memcmp(a.data, b.data, shared);
    return order != 0 ? order < 0 : a.size < b.size;
}

static uint32_t units_of(char first) {
    const unsigned byte = static_cast<unsigned char>(first);
    if ((byte & 0xC0u) == 0x80u) return 0;  // behind the first byte of a letter
    return byte >= 0xF0u ? 2 : 1;
}

uint32_t letters_of(Text text) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < text.size; i++) count += units_of(text.data[i]);
    return count;
}

Text first_letters(Text text, uint32_t most) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < text.size; i++) {
        count += units_of(text.data[i]);
        if (count > most) return Text(text.data, i);
    }
    return text;
}

/// Bytes of a letter behind its first one; -1 if none begins so.
static int more_bytes(uint8_t first) {
    if (first < 0x80) return 0;
    if (first < 0xC2 || first > 0xF4) return -1;
    return first < 0xE0 ? 1 : first < 0xF0 ? 2 : 3;
}

bool is_utf8(const uint8_t* bytes, size_t size) {
    for (size_t at = 0; at < size;) {
        uint64_t eight = 0x80;
        if (size - at >= sizeof(eight)) std::memcpy(&eight, bytes + at, sizeof(eight));
        if ((eight & 0x8080808080808080u) == 0) {  // ASCII
            at += sizeof(eight);
            continue;
        }
        const int more = more_bytes(bytes[at]);
        if (more < 0 || static_cast<size_t>(more) >= size - at) return false;
        if (more > 1) {
            const unsigned two = static_cast<unsigned>(bytes[at] << 8 | bytes[at + 1]);
            if (two < 0xE0A0 || (two >= 0xEDA0 && two < 0xEE00) || (two >= 0xF000 && two < 0xF090) || two >= 0xF490) {
                return false;
            }
        }
        for (int i = 1; i <= more; i++) {
            if ((bytes[at + static_cast<size_t>(i)] & 0xC0) != 0x80) return false;
        }
        at += 1 + static_cast<size_t>(more);
    }
    return true;
}

Cut::Cut(Text text, uint32_t most) {
    text = first_letters(text, most < 120 ? most : 120);
    const size_t size = text.size < sizeof(data) ? text.size : sizeof(data) - 1;
    if (size > 0) std::memcpy(data, text.data, size);
    data[size] = 0;
}

Digits::Digits(double value) {
    for (int digits = 15; digits <= 17; digits++) {
        std::snprintf(data, sizeof(data), "%.*g", digits, value);
        if (!std::isfinite(value) || std::strtod(data, nullptr) == value) break;
    }
    const char* point = std::localeconv()->decimal_point;
    for (char* at = data; *at != 0; at++) {
        if (*at == *point) *at = '.';
    }
}

void Errors::set(Text field, const char* format, ...) {
    if (any_) return;
    va_list given;
    va_start(given, format);
    std::vsnprintf(reason_, sizeof(reason_), format, given);
    va_end(given);
    take_field(field);
}

void Errors::set_memory() {
    if (any_) return;
    std::snprintf(reason_, sizeof(reason_), "takes more memory than there is");
    take_field("");
}

void Errors::set_owner(Text owner) {
    Text shown = owner.size < sizeof(owner_) ? owner : first_letters(owner, sizeof(owner_) / 4);
    if (shown.size > 0) std::memcpy(owner_, shown.data, shown.size);
    owner_[shown.size] = 0;
    if (any_) join();
}

void Errors::take_field(Text field) {
    any_ = true;
    const size_t size = field.size < sizeof(field_) ? field.size : sizeof(field_) - 1;
    if (size > 0) std::memcpy(field_, field.data, size);
    field_[size] = 0;
    join();
}

/// One line: every run of spaces, tabs and ends of lines becomes one space.
void Errors::join() {
    char* to = line_;
    const char* parts[] = {owner_, owner_[0] != 0 ? ": " : "", field_, field_[0] != 0 ? ": " : "", reason_};
    bool space = true;
    for (const char* part : parts) {
        for (const char* from = part; *from != 0; from++) {
            const bool is_space = *from == ' ' || (*from >= '\t' && *from <= '\r');
            if (is_space && space) continue;
            *to++ = is_space ? ' ' : *from;
            space = is_space;
        }
    }
    if (to > line_ && to[-1] == ' ') to--;
    *to = 0;
}

}  // namespace avatar
