#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__GNUC__)
#define AVATAR_FORMAT(text, first) __attribute__((format(printf, text, first)))
#else
#define AVATAR_FORMAT(text, first)
#endif

namespace avatar {

/// UTF-8 that somebody else holds. Texts that an avatar keeps end with a zero behind their last byte.
struct Text {
    const char* data = "";
    uint32_t size = 0;

    Text() = default;
    Text(const char* letters) : data(letters), size(letters == nullptr ? 0 : static_cast<uint32_t>(std::strlen(letters))) {}
    constexpr Text(const char* letters, size_t bytes) : data(letters), size(static_cast<uint32_t>(bytes)) {}

    bool operator==(Text other) const { return size == other.size && (size == 0 || std::memcmp(data, other.data, size) == 0); }
    bool operator!=(Text other) const { return !(*this == other); }
    bool begins(Text other) const { return size >= other.size && (other.size == 0 || std::memcmp(data, other.data, other.size) == 0); }
};

/// Orders texts by their bytes.
bool text_before(Text a, Text b);

/// Letters of a text: code points.
uint32_t letters_of(Text text);

/// The first letters of a text. It ends at the border of a letter.
Text first_letters(Text text, uint32_t most);

/// Whether bytes are UTF-8: neither too long, nor a surrogate, nor above U+10FFFF.
bool is_utf8(const uint8_t* bytes, size_t size);

/// The first letters of a text, at most 120, ready for a format of printf. A letter that would move or hide what stands
/// around it, such as an escape or a mark of direction, is written as \\u001b.
struct Cut {
    char data[3 * 120 + 1];

    Cut(Text text, uint32_t most);
};

/// A number as a message shows it: as many digits as it has, with a point.
struct Digits {
    char data[40];

    explicit Digits(double value);
};

/// The first error of a piece of work: one line that says whose file, which field, what, what to do. Later errors are
/// ignored, so that a reader may go on with empty values to its next check. Setting it allocates nothing.
class Errors {
public:
    /// Whether there is one.
    bool any() const { return any_; }

    /// Sets the error of a field; "" is none. `format` is printf's.
    void set(Text field, const char* format, ...) AVATAR_FORMAT(3, 4);

    /// Sets the error for memory that was not given.
    void set_memory();

    /// Sets the error for a `name` that is not among the `known` names of a `what`. It lists near matches.
    void set_no_such(Text field, const char* what, Text name, const Text* known, size_t count);

    /// Whose avatar or file it is.
    void set_owner(Text owner);

    /// Forgets the error.
    void clear() { any_ = false; }

    const char* field() const { return field_; }
    const char* reason() const { return reason_; }
    /// The whole line; null where there is no error.
    const char* line() const { return any_ ? line_ : nullptr; }

private:
    static constexpr size_t most_reason = 480, most_field = 320, most_owner = 160;

    void take_field(Text field);
    void join();

    bool any_ = false;
    char reason_[most_reason] = "";
    char field_[most_field] = "";
    char owner_[most_owner] = "";
    char line_[most_reason + most_field + most_owner + 4] = "";
};

}  // namespace avatar
