#pragma once
#include "read.h"

namespace avatar {

constexpr double u32_end = 4294967296.0;
constexpr double most_float32 = 3.4028234663852886e38;

/// What a pointer section says of its rows.
struct PointerRows {
    bool rises;      // it begins with 0 and never falls
    double last;     // its last element
    double longest;  // entries of the longest row
};

/// A static buffer: where its sections begin, and what is found in them. Each is searched once.
class Packed {
public:
    bool make(const Buffer& buffer, Arena& arena);

    /// The place of the section of that name; its number of sections: there is none.
    size_t find(Text name) const;
    const Section& section(size_t at) const { return buffer_->sections[at]; }
    /// Its first word.
    double offset(size_t at) const { return found_[at].offset; }
    double words() const { return words_; }
    size_t size() const { return found_.size; }
    /// The largest element; -1 of none.
    double largest(size_t at) const;
    /// Whether all elements, float32 by their bits, are finite and no larger than `most`.
    bool is_finite(size_t at, double most = most_float32) const;
    const PointerRows& rows(size_t at) const;

private:
    struct Found {
        double offset, largest, size;
        PointerRows rows;
        bool has_largest, has_size, has_rows;
    };

    const Buffer* buffer_;
    Span<Found> found_;
    double words_;
};

/// A section of Pose: its first float, and how many items it has.
struct PoseSection {
    Text name;
    double first, items;
};

/// What passes refer to: buffers, sections found in them, sections of Pose.
struct Held {
    Program* program;
    Span<Packed> packed;  // by buffer
    PoseSection pose[4];

    const PoseSection& section(Text name) const;
};

/// Whether a value is one of the known ones.
bool is_listed(const Table<uint32_t>& known, double value);

/// Known values as a message shows them.
struct ListedNumbers {
    char data[120];

    explicit ListedNumbers(const Table<uint32_t>& numbers);
};

/// Stage morph moves every vertex once, run after run, and then stage skin where there are joints.
void check_mesh(const Program& program, bool has_joints, Errors& errors);
/// The chunks of a level follow each other.
void check_chunks(const char* place, const Level& level, Errors& errors);
/// A list of passes of a level, as a field of an error.
struct ListName {
    char data[48];
    ListName(const char* place, const char* list);
};

/// Every chunk is projected once, and lit once where there is a light.
void check_projected(const char* place, const Level& level, Arena& scratch);
/// Every chunk is blended once, and placed: by one pass over the mesh, or by passes that share one buffer.
void check_placed(const char* place, const Level& level, bool reads_mesh, Arena& scratch);

/// One pass against the access contract of its entry: what a kernel would read and write, checked before it runs. It
/// knows no entry, no system and no rule. Every check sets the error and returns false, or 0, where it fails.
class Access {
public:
    Access(const char* where, Pass& pass, const Held& held, Errors& errors);

    const Interface* declared = nullptr;  // null where the entry is not known
    Pass& pass;

    /// Unless the entry is known and the pass binds and sets exactly what it declares.
    bool check_names();
    /// Types and ranges of the constants. Names of the frame are not looked at.
    bool check_constants() const;
    /// The sections that the pass reads. Returns the entries of all pointers together.
    double check_sections() const;

    bool fail(Text what, const char* format, ...) const AVATAR_FORMAT(3, 4);
    const Contract& contract() const { return *declared->access; }
    /// A constant that is a whole number.
    double count(Text name) const;
    bool applies(const Table<Values>& when) const;
    /// The value of an expression of the contract.
    double number(const char* expression) const;
    bool is_packed(Text buffer) const;
    const StorageBuffer* storage(Text buffer) const;
    ConstantType type_of(Text constant) const;
    /// Elements of a buffer without sections that the pass touches.
    double touched_elements(Text buffer) const;
    bool failed() const { return errors_.any(); }

private:
    struct Found {
        const Packed* packed;
        size_t at;
    };

    bool find(Text name, Text buffer, Found* into) const;
    bool check_buffers();
    bool check_type(const Constant& value) const;
    bool check_ranges() const;
    double factor(Text factor) const;
    bool check_section(const SectionContract& expected) const;
    bool check_length(const SectionContract& expected, const Section& section, double width, double wanted) const;
    bool check_kind(const SectionContract& expected, const Found& found, double width) const;
    bool check_scale(const SectionContract& expected, const Found& found, double width) const;
    bool check_below(Text name, double largest, double end) const;

    const Held& held_;
    Errors& errors_;
    char place_[200];
};

}  // namespace avatar
