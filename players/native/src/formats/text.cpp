#include "text.h"

#include <clocale>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>

namespace avatar {

static constexpr uint32_t no_letter = UINT32_MAX;

bool text_before(Text a, Text b) {
    const uint32_t shared = a.size < b.size ? a.size : b.size;
    const int order = shared == 0 ? 0 : std::memcmp(a.data, b.data, shared);
    return order != 0 ? order < 0 : a.size < b.size;
}

static bool begins_letter(char byte) { return (static_cast<unsigned char>(byte) & 0xC0u) != 0x80u; }

uint32_t letters_of(Text text) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < text.size; i++) count += begins_letter(text.data[i]);
    return count;
}

Text first_letters(Text text, uint32_t most) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < text.size; i++) {
        count += begins_letter(text.data[i]);
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

/// The letter at a place, and its bytes; of what is no UTF-8 one byte, and no letter.
static uint32_t letter_at(const char* text, size_t size, size_t* bytes) {
    const uint8_t* at = reinterpret_cast<const uint8_t*>(text);
    const int more = more_bytes(*at);
    *bytes = more < 0 ? 1 : 1 + static_cast<size_t>(more);
    if (more < 0 || *bytes > size || !is_utf8(at, *bytes)) {
        *bytes = 1;
        return no_letter;
    }
    uint32_t letter = more == 0 ? *at : *at & (0x3Fu >> more);
    for (int i = 1; i <= more; i++) letter = letter << 6 | (at[i] & 0x3Fu);
    return letter;
}

/// Whether a letter moves or hides what stands around it.
static bool is_control(uint32_t letter) {
    return letter < 0x20 || (letter >= 0x7F && letter < 0xA0) || letter == 0x61C || (letter >= 0x200B && letter <= 0x200F) ||
           (letter >= 0x2028 && letter <= 0x202E) || (letter >= 0x2066 && letter <= 0x2069) || letter == 0xFEFF;
}

/// Writes the first letters of a text, at most `most` and as many as fit, with a zero behind.
static void show(Text text, uint32_t most, char* into, size_t size) {
    uint32_t written = 0;
    for (size_t at = 0, bytes; at < text.size; at += bytes) {
        const uint32_t letter = letter_at(text.data + at, text.size - at, &bytes);
        const bool escapes = is_control(letter);
        const size_t takes = escapes ? 6 : bytes;
        written += escapes ? 6 : bytes > 3 ? 2 : 1;
        if (written > most || takes >= size) break;
        if (escapes) std::snprintf(into, size, "\\u%04x", letter);
        else std::memcpy(into, text.data + at, bytes);
        into += takes;
        size -= takes;
    }
    *into = 0;
}

Cut::Cut(Text text, uint32_t most) { show(text, most, data, sizeof(data)); }

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
    show(owner, UINT32_MAX, owner_, sizeof(owner_));
    if (any_) join();
}

void Errors::take_field(Text field) {
    any_ = true;
    const size_t size = field.size < sizeof(field_) ? field.size : sizeof(field_) - 1;
    if (size > 0) std::memcpy(field_, field.data, size);
    field_[size] = 0;
    join();
}

/// One line: every run of spaces, tabs and ends of lines becomes one space. A letter that was cut in two is left out.
void Errors::join() {
    char* to = line_;
    const char* parts[] = {owner_, owner_[0] != 0 ? ": " : "", field_, field_[0] != 0 ? ": " : "", reason_};
    bool space = true;
    for (const char* part : parts) {
        size_t left = std::strlen(part), bytes = 0;
        for (const char* from = part; left > 0; from += bytes, left -= bytes) {
            const bool is_letter = letter_at(from, left, &bytes) != no_letter;
            const bool is_space = *from == ' ' || (*from >= '\t' && *from <= '\r');
            if (!is_letter || (is_space && space)) continue;
            std::memcpy(to, is_space ? " " : from, bytes);
            to += bytes;
            space = is_space;
        }
    }
    if (to > line_ && to[-1] == ' ') to--;
    *to = 0;
}

}  // namespace avatar
