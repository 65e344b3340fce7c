#include <cstdio>

#include "read.h"

namespace avatar {

static constexpr double most_offset = 281474976710656.0;  // 2^48

static bool parse_named(JsonTree& tree, Text text, const char* what, Errors& errors) {
    if (tree.parse(text)) return true;
    errors.set("", "its %s is not JSON (%s)", what, tree.why);
    return false;
}

static TensorEntry read_entry(Json said) {
    const JsonList offsets = said.at("data_offsets").list(2, 2), shape = said.at("shape").list(1, 1);
    if (said.errors().any()) return {};
    const TensorEntry entry = {offsets[0].whole(0, most_offset), offsets[1].whole(0, most_offset)};
    const double length = shape[0].whole(0, most_offset);
    if (said.at("dtype").text() != "U8" || entry.begin > entry.end || length != entry.end - entry.begin) {
        said.set("is not the entry of a tensor of bytes");
    }
    return entry;
}

bool Header::read(Text text, Arena& scratch) {
    Errors& errors = scratch.errors();
    if (!parse_named(tree, text, "header", errors)) return false;
    const JsonList said = Json(tree, errors).entries();
    tensors = scratch.make<TensorEntry>(said.size);
    if (!names.make(scratch, said.size) || tensors.size < said.size) return false;
    Text pack;
    bool has_pack = false;
    uint32_t count = 0;
    for (Json one : said) {
        if (one.key() == "__metadata__") {
            const Json member = one.at("pack");
            has_pack = member.given();
            if (has_pack) pack = member.text();
        } else {
            tensors[count] = read_entry(one);
            names.add(one.key(), count++);
        }
        if (errors.any()) return false;
    }
    tensors.size = count;
    if (!has_pack) {
        errors.set("", "is not a pack: it has no document 'pack' in its metadata");
        return false;
    }
    return !errors.any() && parse_named(document, pack, "document 'pack'", errors);
}

}  // namespace avatar
