// Parses JSON text. What is no number of a float64, and half a pair of surrogates, is refused.
#include <cfloat>
#include <cmath>
#include <cstdio>

#include "json.h"

namespace avatar {

static constexpr uint32_t most_depth = 64;  // lists and objects inside each other
static constexpr uint32_t most_values = 1 << 21;
static constexpr uint32_t few = 8;  // names that are compared one by one
static constexpr Text most_whole("9007199254740992", 16);  // 2^53: beyond, not every whole number is a float64

class JsonParser {
public:
    JsonParser(JsonTree& tree, Text text)
        : tree_(tree), text_(text.data), size_(text.size), seen_(tree.arena_.allocator(), tree.arena_.errors()) {}

    bool run() {
        if (value(JsonNode::none) == JsonNode::none) return false;
        skip_space();
        return at_ == size_ || fail("more text follows the value");
    }

private:
    bool fail(const char* what) {
        if (tree_.why[0] == 0) {
            std::snprintf(tree_.why, sizeof(tree_.why), "%s at letter %u", what, letters_of(Text(text_, at_)));
        }
        return false;
    }

    void skip_space() {
        while (at_ < size_ && (text_[at_] == ' ' || text_[at_] == '\n' || text_[at_] == '\r' || text_[at_] == '\t')) at_++;
    }

    /// The next letter behind spaces; 0 at the end, which is an error.
    char next() {
        skip_space();
        if (at_ < size_ && text_[at_] != 0) return text_[at_];
        fail(at_ < size_ ? "a control letter" : "the text ends too early");
        return 0;
    }

    /// The node of the next value; none where something is wrong.
    uint32_t value(uint32_t parent) {
        if (tree_.nodes_.size() == most_values) {
            fail("more than 2097152 values");
            return JsonNode::none;
        }
        JsonNode made = {};
        made.parent = parent;
        made.next = JsonNode::none;
        const uint32_t index = static_cast<uint32_t>(tree_.nodes_.size());
        if (!tree_.nodes_.add(made)) return JsonNode::none;
        return fill(index) ? index : JsonNode::none;
    }

    bool fill(uint32_t index) {
        JsonNode& node = tree_.nodes_[index];
        const char first = next();
        switch (first) {
            case 0: return false;
            case '{':
            case '[': return nested(index, first == '{');
            case '"': {
                Text read;
                if (!text(&read)) return false;
                node.kind = JsonKind::text;
                node.text = read.data;
                node.size = read.size;
                return true;
            }
            case 't': node.flag = true; return word("true", node, JsonKind::flag);
            case 'f': node.flag = false; return word("false", node, JsonKind::flag);
            case 'n': return word("null", node, JsonKind::null);
            default: return number(node);
        }
    }

    bool word(const char* letters, JsonNode& node, JsonKind kind) {
        const uint32_t size = Text(letters).size;
        if (size_ - at_ < size || std::memcmp(text_ + at_, letters, size) != 0) return fail("an unknown word");
        at_ += size;
        node.kind = kind;
        return true;
    }

    bool nested(uint32_t index, bool is_object) {
        if (++depth_ > most_depth) return fail("more than 64 values inside each other");
        at_++;
        uint32_t first = JsonNode::none, last = JsonNode::none, count = 0;
        const char end = is_object ? '}' : ']';
        const char begin = next();
        if (begin == 0) return false;
        bool goes = begin != end;
        if (!goes) at_++;
        while (goes) {
            Text key;
            if (is_object && !member_name(&key)) return false;
            const uint32_t one = value(index);
            if (one == JsonNode::none) return false;
            tree_.nodes_[one].key = key.data;
            tree_.nodes_[one].key_size = key.size;
            if (last == JsonNode::none) first = one;
            else tree_.nodes_[last].next = one;
            last = one;
            count++;
            const char letter = next();
            if (letter == 0) return false;
            if (letter != ',' && letter != end) return fail(is_object ? "a comma or } is needed" : "a comma or ] is needed");
            at_++;
            goes = letter == ',';
        }
        depth_--;
        JsonNode& node = tree_.nodes_[index];
        node.kind = is_object ? JsonKind::object : JsonKind::list;
        node.first = first;
        node.size = count;
        return !is_object || names_differ(node);
    }

    bool member_name(Text* into) {
        const char quote = next();
        if (quote == 0) return false;
        if (quote != '"') return fail("a name is needed");
        if (!text(into)) return false;
        const char colon = next();
        if (colon == 0) return false;
        if (colon != ':') return fail("a colon is needed");
        at_++;
        return true;
    }

    Text key_of(uint32_t index) { return Text(tree_.nodes_[index].key, tree_.nodes_[index].key_size); }

    bool names_differ(const JsonNode& object) {
        if (object.size <= few) {
            for (uint32_t a = object.first; a != JsonNode::none; a = tree_.nodes_[a].next) {
                for (uint32_t b = tree_.nodes_[a].next; b != JsonNode::none; b = tree_.nodes_[b].next) {
                    if (key_of(a) == key_of(b)) return fail("a name stands twice");
                }
            }
            return true;
        }
        size_t slots = 32;
        while (slots < 2 * static_cast<size_t>(object.size)) slots *= 2;
        if (!seen_.reserve(slots)) return false;
        std::memset(seen_.data(), 0, slots * sizeof(uint32_t));
        for (uint32_t one = object.first; one != JsonNode::none; one = tree_.nodes_[one].next) {
            size_t at = hash_of(key_of(one)) & (slots - 1);
            for (; seen_[at] != 0; at = (at + 1) & (slots - 1)) {
                if (key_of(seen_[at] - 1) == key_of(one)) return fail("a name stands twice");
            }
            seen_[at] = one + 1;
        }
        return true;
    }

    /// A text: where it has no escapes, a part of what is parsed.
    bool text(Text* into) {
        const uint32_t begin = ++at_;
        bool escapes = false;
        for (;; at_++) {
            if (at_ >= size_) return fail("a text without end");
            const unsigned char letter = static_cast<unsigned char>(text_[at_]);
            if (letter == '"') break;
            if (letter < ' ') return fail("a control letter");
            if (letter != '\\') continue;
            escapes = true;
            if (++at_ >= size_) return fail("a text without end");
        }
        const uint32_t end = at_;
        *into = Text(text_ + begin, end - begin);
        if (escapes && !unescape(into, begin, end)) return false;
        at_ = end + 1;
        return true;
    }

    bool unescape(Text* into, uint32_t begin, uint32_t end) {
        Span<char> made = tree_.arena_.make<char>(static_cast<size_t>(end - begin) + 1);
        if (made.empty()) return false;
        size_t size = 0;
        for (at_ = begin; at_ < end;) {
            const void* found = std::memchr(text_ + at_, '\\', end - at_);
            const uint32_t plain = found == nullptr ? end - at_ : static_cast<uint32_t>(static_cast<const char*>(found) - text_) - at_;
            std::memcpy(made.data + size, text_ + at_, plain);
            size += plain;
            at_ += plain;
            if (at_ == end) break;
            uint32_t code = 0;
            if (!escaped(&code, end)) return false;
            size += put(made.data + size, code);
        }
        *into = Text(made.data, size);
        return true;
    }

    bool escaped(uint32_t* code, uint32_t end) {
        const char kind = text_[at_ + 1];
        at_ += 2;
        switch (kind) {
            case '"':
            case '\\':
            case '/': *code = static_cast<unsigned char>(kind); return true;
            case 'b': *code = '\b'; return true;
            case 'f': *code = '\f'; return true;
            case 'n': *code = '\n'; return true;
            case 'r': *code = '\r'; return true;
            case 't': *code = '\t'; return true;
            case 'u': break;
            default: return fail("an unknown escape");
        }
        if (!unit(code, end)) return false;
        if (*code == 0) return fail("the letter U+0000");
        if (*code < 0xD800 || *code >= 0xE000) return true;
        uint32_t low = 0;
        const bool pairs = *code < 0xDC00 && end - at_ >= 6 && text_[at_] == '\\' && text_[at_ + 1] == 'u';
        if (pairs) at_ += 2;
        if (pairs && !unit(&low, end)) return false;
        if (low < 0xDC00 || low >= 0xE000) return fail("half a pair of surrogates");
        *code = 0x10000 + ((*code - 0xD800) << 10) + (low - 0xDC00);
        return true;
    }

    bool unit(uint32_t* code, uint32_t end) {
        *code = 0;
        for (int i = 0; i < 4; i++, at_++) {
            const int digit = at_ < end ? hex(text_[at_]) : -1;
            if (digit < 0) return fail("four hexadecimal digits are needed");
            *code = 16 * *code + static_cast<uint32_t>(digit);
        }
        return true;
    }

    static int hex(char letter) {
        if (letter >= '0' && letter <= '9') return letter - '0';
        if (letter >= 'a' && letter <= 'f') return letter - 'a' + 10;
        return letter >= 'A' && letter <= 'F' ? letter - 'A' + 10 : -1;
    }

    /// Writes a letter as UTF-8. No escape is shorter.
    static size_t put(char* into, uint32_t code) {
        if (code < 0x80) {
            into[0] = static_cast<char>(code);
            return 1;
        }
        const size_t more = code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
        const uint32_t marks[] = {0, 0xC0, 0xE0, 0xF0};
        into[0] = static_cast<char>(marks[more] | code >> (6 * more));
        for (size_t i = 1; i <= more; i++) into[i] = static_cast<char>(0x80u | (code >> (6 * (more - i)) & 0x3Fu));
        return more + 1;
    }

    bool number(JsonNode& node) {
        const uint32_t begin = at_;
        bool is_whole = true;
        if (text_[at_] == '-') at_++;
        if (at_ < size_ && text_[at_] == '0') at_++;
        else if (!digits()) return false;
        if (at_ < size_ && text_[at_] == '.') {
            is_whole = false;
            at_++;
            if (!digits()) return false;
        }
        if (at_ < size_ && (text_[at_] == 'e' || text_[at_] == 'E')) {
            is_whole = false;
            at_++;
            if (at_ < size_ && (text_[at_] == '+' || text_[at_] == '-')) at_++;
            if (!digits()) return false;
        }
        node.kind = JsonKind::number;
        const Text said(text_ + begin, at_ - begin);
        node.number = parse_number(said, tree_.arena_);
        if (is_whole && node.number == 0) node.number = 0;  // -0
        const Text digits(said.data + (said.data[0] == '-'), said.size - (said.data[0] == '-'));
        const bool fits = digits.size < most_whole.size || (digits.size == most_whole.size && !text_before(most_whole, digits));
        return (is_whole ? fits : std::fabs(node.number) <= DBL_MAX) || fail("a number is too large");
    }

    bool digits() {
        const uint32_t begin = at_;
        while (at_ < size_ && text_[at_] >= '0' && text_[at_] <= '9') at_++;
        return at_ > begin || fail("a value is needed");
    }

    JsonTree& tree_;
    const char* text_;
    uint32_t size_;
    uint32_t at_ = 0;
    uint32_t depth_ = 0;
    Grown<uint32_t> seen_;  // hashed members of the object in hand
};

bool JsonTree::parse(Text text) {
    if (!is_utf8(reinterpret_cast<const uint8_t*>(text.data), text.size)) {
        std::snprintf(why, sizeof(why), "it is not UTF-8");
        return false;
    }
    JsonParser parser(*this, text);
    return parser.run() && !arena_.errors().any();
}

}  // namespace avatar
