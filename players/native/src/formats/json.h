#pragma once
#include "memory.h"

namespace avatar {

enum class JsonKind : uint8_t { null, flag, number, text, list, object };

/// A value of a JSON text. Its members or items are a chain.
struct JsonNode {
    static constexpr uint32_t none = UINT32_MAX;

    const char* key;    // of a member of an object
    uint32_t key_size;  // bytes
    uint32_t parent;
    uint32_t next;  // of the same parent
    uint32_t size;  // bytes of a text, items of a list, members of an object
    JsonKind kind;
    union {
        double number;
        bool flag;
        const char* text;
        uint32_t first;  // member or item
    };
};

/// A parsed JSON text. It refuses a name that an object has twice, and what would take much memory or stack.
class JsonTree {
public:
    JsonTree(Arena& arena, const char* root) : root_name(root), nodes_(arena.allocator(), arena.errors()), arena_(arena) {}

    /// Parses a text, which must live as long as the tree. Returns false where it is no JSON: `why` says why. Lack of
    /// memory is in the arena's errors.
    bool parse(Text text);

    const char* const root_name;  // "$", "header": how paths begin
    char why[120] = "";

    const JsonNode& node(uint32_t index) const { return nodes_[index]; }

private:
    friend class JsonParser;

    Grown<JsonNode> nodes_;
    Arena& arena_;
};

/// The number of a JSON number's letters, rounded to the nearest float64. NaN where it has no memory to compute with.
double parse_number(Text text, Arena& arena);

class JsonList;

/// A JSON value and where it stands, maybe a missing one. Every reader checks it, and sets the error with the place where
/// it does not fit; then it returns an empty value.
class Json {
public:
    Json(const JsonTree& tree, Errors& errors) : tree_(&tree), errors_(&errors), node_(0) {}

    bool is_missing() const { return node_ == JsonNode::none; }
    bool is(JsonKind kind) const { return !is_missing() && node().kind == kind; }
    /// Whether it is neither missing nor null.
    bool given() const { return !is_missing() && node().kind != JsonKind::null; }

    /// Member `name` of an object; maybe a missing one. `find` also takes what is no object.
    Json at(Text name) const;
    Json find(Text name) const;
    /// The members of an object in their order: key() of each.
    JsonList entries() const;
    /// The items of a list; none of another value.
    JsonList items() const;
    /// A list of at least `least` and at most `most` values.
    JsonList list(uint32_t least = 0, uint32_t most = UINT32_MAX) const;
    /// Of a member of an object.
    Text key() const { return Text(node().key, node().key_size); }

    Text text() const;
    /// A list of texts, copied.
    Span<Text> texts(Arena& arena) const;
    /// A whole number.
    double whole(double least = 0, double most = 4294967295.0) const;
    /// A whole number of 31 bits.
    int32_t integer(int32_t least = 0, int32_t most = INT32_MAX) const;
    /// A finite number.
    double number() const;
    bool flag() const;
    /// Three numbers.
    void vector(double* into) const;

    /// Sets the error for a value of another kind.
    void fail(const char* needed) const;
    /// Sets an error about this value.
    void set(const char* line) const;

    Errors& errors() const { return *errors_; }
    /// Such as $.levels[0].count; written into `into`.
    void path(char* into, size_t size) const;

private:
    friend class JsonList;

    Json(const JsonTree* tree, Errors* errors, uint32_t node) : tree_(tree), errors_(errors), node_(node) {}
    const JsonNode& node() const { return tree_->node(node_); }

    const JsonTree* tree_;
    Errors* errors_;
    uint32_t node_;
    uint32_t parent_ = JsonNode::none;  // of a missing member
    Text missing_;                      // its name
};

/// The items of a list, or the members of an object.
class JsonList {
public:
    class Iterator {
    public:
        Iterator(const JsonTree* tree, Errors* errors, uint32_t at) : tree_(tree), errors_(errors), at_(at) {}
        Json operator*() const { return Json(tree_, errors_, at_); }
        Iterator& operator++() {
            at_ = tree_->node(at_).next;
            return *this;
        }
        bool operator!=(const Iterator& other) const { return at_ != other.at_; }

    private:
        const JsonTree* tree_;
        Errors* errors_;
        uint32_t at_;
    };

    JsonList(const JsonTree* tree, Errors* errors, uint32_t first, uint32_t count)
        : size(count), tree_(tree), errors_(errors), first_(first) {}

    Iterator begin() const { return Iterator(tree_, errors_, first_); }
    Iterator end() const { return Iterator(tree_, errors_, JsonNode::none); }
    /// Item i, which there is.
    Json operator[](uint32_t i) const;

    const uint32_t size;

private:
    const JsonTree* tree_;
    Errors* errors_;
    uint32_t first_;
};

}  // namespace avatar
