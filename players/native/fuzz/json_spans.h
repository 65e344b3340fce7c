#pragma once
#include <cstddef>
#include <cstdint>

/// A value or a key of a JSON text, by its place.
struct JsonSpan {
    enum Kind : uint8_t { object, list, text, number, word, key };

    uint32_t begin, end;  // quotes and brackets included
    uint32_t member;      // where the member begins: at its key, or at the value itself
    Kind kind;
};

/// The values and keys of a JSON text in the order of their ends. Damaged texts give what is found.
struct JsonSpans {
    static constexpr size_t most = 8192;

    JsonSpan items[most];
    size_t count = 0;

    /// Reads bytes `begin` to `end`. `escaped`: the text is itself inside of a JSON string, so that a quote is \" there.
    void scan(const uint8_t* bytes, size_t begin, size_t end, bool escaped);
};
