#include "json.h"

#include <cmath>
#include <cstdio>

namespace avatar {

static constexpr uint32_t most_shown = 40;  // letters of a wrong value in a message
static constexpr size_t most_path = 300;    // bytes

Json Json::at(Text name) const {
    if (!is(JsonKind::object)) fail("a JSON object is needed");
    return find(name);
}

Json Json::find(Text name) const {
    Json member(tree_, errors_, JsonNode::none);
    member.parent_ = is_missing() ? parent_ : node_;
    member.missing_ = name;
    if (!is(JsonKind::object)) return member;
    for (uint32_t at = node().first; at != JsonNode::none; at = tree_->node(at).next) {
        if (Text(tree_->node(at).key, tree_->node(at).key_size) == name) return Json(tree_, errors_, at);
    }
    return member;
}

JsonList Json::items() const {
    const bool has = is(JsonKind::list);
    return JsonList(tree_, errors_, has ? node().first : JsonNode::none, has ? node().size : 0);
}

JsonList Json::entries() const {
    if (!is(JsonKind::object)) {
        fail("a JSON object is needed");
        return JsonList(tree_, errors_, JsonNode::none, 0);
    }
    return JsonList(tree_, errors_, node().first, node().size);
}

JsonList Json::list(uint32_t least, uint32_t most) const {
    const JsonList nothing(tree_, errors_, JsonNode::none, 0);
    if (!is(JsonKind::list)) {
        fail("a list is needed");
        return nothing;
    }
    if (node().size < least || node().size > most) {
        char line[96];
        std::snprintf(line, sizeof(line), "has %u items; %u to %u are taken", node().size, least, most);
        set(line);
        return nothing;
    }
    return JsonList(tree_, errors_, node().first, node().size);
}

Json JsonList::operator[](uint32_t i) const {
    uint32_t at = first_;
    while (i-- > 0) at = tree_->node(at).next;
    return Json(tree_, errors_, at);
}

Text Json::text() const {
    if (is(JsonKind::text)) return Text(node().text, node().size);
    fail("text is needed");
    return {};
}

Span<Text> Json::texts(Arena& arena) const {
    const JsonList said = list();
    Span<Text> found = arena.make<Text>(said.size);
    size_t at = 0;
    for (Json one : said) {
        if (found.size < said.size || errors_->any()) return {};
        found[at++] = arena.copy(one.text());
    }
    return found;
}

double Json::whole(double least, double most) const {
    const double number = is(JsonKind::number) ? node().number : NAN;
    if (number >= least && number <= most && std::floor(number) == number) return number;
    char line[96];
    std::snprintf(line, sizeof(line), "a whole number of %.0f to %.0f is needed", least, most);
    fail(line);
    return 0;
}

int32_t Json::integer(int32_t least, int32_t most) const { return static_cast<int32_t>(whole(least, most)); }

double Json::number() const {
    const double number = is(JsonKind::number) ? node().number : NAN;
    if (std::isfinite(number)) return number;
    fail("a finite number is needed");
    return 0;
}

bool Json::flag() const {
    if (is(JsonKind::flag)) return node().flag;
    fail("true or false is needed");
    return false;
}

void Json::vector(double* into) const {
    into[0] = into[1] = into[2] = 0;
    for (Json one : list(3, 3)) *into++ = one.number();
}

void Json::fail(const char* needed) const {
    if (errors_->any()) return;
    char shown[4 * most_shown + 40] = "is missing";
    if (!is_missing()) {
        switch (node().kind) {
            case JsonKind::null: std::snprintf(shown, sizeof(shown), "is null"); break;
            case JsonKind::flag: std::snprintf(shown, sizeof(shown), "is %s", node().flag ? "true" : "false"); break;
            case JsonKind::number: std::snprintf(shown, sizeof(shown), "is %s", Digits(node().number).data); break;
            case JsonKind::text: {
                const Cut cut(Text(node().text, node().size), most_shown);
                std::snprintf(shown, sizeof(shown), "is '%s'", cut.data);
                break;
            }
            case JsonKind::list: std::snprintf(shown, sizeof(shown), "is a list"); break;
            case JsonKind::object: std::snprintf(shown, sizeof(shown), "is an object"); break;
        }
    }
    char where[most_path];
    path(where, sizeof(where));
    errors_->set(where, "%s; %s", shown, needed);
}

void Json::set(const char* line) const {
    if (errors_->any()) return;
    char where[most_path];
    path(where, sizeof(where));
    errors_->set(where, "%s", line);
}

void Json::path(char* into, size_t size) const {
    uint32_t chain[66];  // deeper texts are refused
    uint32_t length = 0;
    for (uint32_t at = is_missing() ? parent_ : node_; at != JsonNode::none; at = tree_->node(at).parent) chain[length++] = at;
    size_t used = static_cast<size_t>(std::snprintf(into, size, "%s", tree_->root_name));
    for (uint32_t i = length > 0 ? length - 1 : 0; i-- > 0 && used < size;) {
        const JsonNode& one = tree_->node(chain[i]);
        const JsonNode& parent = tree_->node(one.parent);
        int more = 0;
        if (parent.kind == JsonKind::object) {
            more = std::snprintf(into + used, size - used, ".%s", Cut(Text(one.key, one.key_size), 80).data);
        } else {
            uint32_t index = 0;
            for (uint32_t before = parent.first; before != chain[i]; before = tree_->node(before).next) index++;
            more = std::snprintf(into + used, size - used, "[%u]", index);
        }
        used += static_cast<size_t>(more);
    }
    if (is_missing() && used < size) std::snprintf(into + used, size - used, ".%s", Cut(missing_, 80).data);
}

}  // namespace avatar
