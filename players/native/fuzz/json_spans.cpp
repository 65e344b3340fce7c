#include "json_spans.h"

// Inputs are made here, not judged: no sanitizer slows it down, and no coverage is counted.
#pragma clang attribute push(__attribute__((no_sanitize("address", "undefined", "coverage"))), apply_to = function)

namespace {

constexpr size_t most_open = 64;

struct Scanner {
    const uint8_t* bytes;
    size_t end;
    bool escaped;
    JsonSpans& found;
    JsonSpan open[most_open];
    size_t depth = 0;
    size_t member = SIZE_MAX;  // where the member of the next value begins

    bool is_quote(size_t at) const {
        if (!escaped) return bytes[at] == '"';
        return at + 1 < end && bytes[at] == '\\' && bytes[at + 1] == '"';
    }

    void add(JsonSpan span) {
        if (found.count < JsonSpans::most) found.items[found.count++] = span;
    }

    JsonSpan made(size_t begin, size_t behind, JsonSpan::Kind kind) {
        const size_t from = member == SIZE_MAX ? begin : member;
        member = SIZE_MAX;
        return {static_cast<uint32_t>(begin), static_cast<uint32_t>(behind), static_cast<uint32_t>(from), kind};
    }

    /// Behind the string that begins at a quote.
    size_t behind_string(size_t at) const {
        const size_t quote = escaped ? 2 : 1;
        at += quote;
        while (at < end && !is_quote(at)) {
            if (bytes[at] != '\\') at++;
            else if (escaped && at + 2 < end && bytes[at + 1] == '\\') at += bytes[at + 2] == '\\' ? 4 : is_quote(at + 2) ? 4 : 3;
            else at += 2;
        }
        return at + quote < end ? at + quote : end;
    }

    size_t take(size_t at) {
        const uint8_t letter = bytes[at];
        if (is_quote(at)) {
            const size_t behind = behind_string(at);
            if (behind < end && bytes[behind] == ':') {
                member = at;
                add({static_cast<uint32_t>(at), static_cast<uint32_t>(behind), static_cast<uint32_t>(at), JsonSpan::key});
            } else {
                add(made(at, behind, JsonSpan::text));
            }
            return behind;
        }
        if (letter == '{' || letter == '[') {
            if (depth < most_open) open[depth++] = made(at, at, letter == '{' ? JsonSpan::object : JsonSpan::list);
            return at + 1;
        }
        if ((letter == '}' || letter == ']') && depth > 0) {
            JsonSpan closed = open[--depth];
            closed.end = static_cast<uint32_t>(at + 1);
            add(closed);
            return at + 1;
        }
        const auto is_part = [&](size_t place) {
            const uint8_t one = bytes[place];
            return (one >= '0' && one <= '9') || (one >= 'a' && one <= 'z') || one == '-' || one == '.' || one == '+' || one == 'E';
        };
        size_t behind = at;
        while (behind < end && is_part(behind)) behind++;
        if (behind == at) return at + 1;
        add(made(at, behind, letter >= 'a' ? JsonSpan::word : JsonSpan::number));
        return behind;
    }
};

}  // namespace

void JsonSpans::scan(const uint8_t* bytes, size_t begin, size_t end, bool escaped) {
    count = 0;
    Scanner scanner = {bytes, end, escaped, *this, {}};
    while (begin < end) begin = scanner.take(begin);
}

#pragma clang attribute pop
