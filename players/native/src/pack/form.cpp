// Checks a document against the form of packs: JSON Schema of few words, which avatar_schema/pack_form.py makes.
#include <cmath>
#include <cstdio>

#include "../made/pack_form.h"
#include "read.h"

namespace avatar {

namespace {

struct Form {
    Json root;
    Arena& scratch;
};

/// What one word of a part of the form asks of a value. Where it does not say so, no error is set.
struct Asked {
    const Form& form;
    Json value, part, given;
    bool says;

    bool fail(const char* needed) const {
        if (says) value.fail(needed);
        return false;
    }
    bool set(const char* line) const {
        if (says) value.set(line);
        return false;
    }
};

struct Kind {
    Text name;
    JsonKind kind;
    const char* needed;
};

/// Texts one after the other, as many as fit.
struct Joined {
    char data[240] = "";
    size_t size = 0;

    void add(const char* text) {
        size += static_cast<size_t>(std::snprintf(data + size, sizeof(data) - size, "%s", text));
        if (size >= sizeof(data)) size = sizeof(data) - 1;
    }
};

/// A word, what of a value it concerns, and whether a value is sound by it.
struct Word {
    Text name;
    bool concerns_all;
    JsonKind kind;
    bool (*is_met)(const Asked& asked);
};

}  // namespace

template <size_t size>
static constexpr Text text_of(const char (&letters)[size]) {
    return Text(letters, size - 1);
}

static constexpr Kind kinds[] = {{text_of("object"), JsonKind::object, "a JSON object"}, {text_of("array"), JsonKind::list, "a list"},
                             {text_of("string"), JsonKind::text, "text"},            {text_of("number"), JsonKind::number, "a finite number"},
                             {text_of("boolean"), JsonKind::flag, "true or false"},  {text_of("null"), JsonKind::null, "null"},
                             {text_of("integer"), JsonKind::number, "a whole number"}};

static bool meets(const Form& form, Json value, Json part, bool says);

/// What `#/$defs/NAME` stands for; else the part itself.
static Json resolved(const Form& form, Json part) {
    constexpr Text place = text_of("#/$defs/");
    const Json reference = part.find("$ref");
    if (reference.is_missing()) return part;
    const Text name = reference.text();
    return name.begins(place) ? form.root.find("$defs").find(Text(name.data + place.size, name.size - place.size)) : part;
}

static bool is_kind(Json value, Text name) {
    for (const Kind& one : kinds) {
        if (one.name == name) return value.is(one.kind) && (name != "integer" || std::floor(value.number()) == value.number());
    }
    return false;
}

/// Whether a part of the form takes a value of this kind.
static bool takes_kind(Json value, Json part) {
    const Json type = part.find("type");
    if (type.is(JsonKind::text)) return is_kind(value, type.text());
    bool found = type.is_missing();
    for (Json one : type.items()) found |= is_kind(value, one.text());
    return found;
}

/// What a part of the form takes, in words.
static Joined needed_by(const Form& form, Json part) {
    const Json type = resolved(form, part).find("type");
    Joined line;
    const auto add = [&](Text name) {
        for (const Kind& one : kinds) {
            if (one.name != name) continue;
            line.add(line.size > 0 ? " or " : "");
            line.add(name == "string" && !part.find("minLength").is_missing() ? "a name" : one.needed);
        }
    };
    if (type.is(JsonKind::text)) add(type.text());
    for (Json one : type.items()) add(one.text());
    line.add(line.size > 0 ? " is needed" : "a value is needed");
    return line;
}

static bool has_type(const Asked& a) { return takes_kind(a.value, a.part) || a.fail(needed_by(a.form, a.part).data); }

/// Whether two values that are neither lists nor objects are the same.
static bool are_equal(Json a, Json b) {
    if (a.is(JsonKind::text)) return b.is(JsonKind::text) && a.text() == b.text();
    if (a.is(JsonKind::number)) return b.is(JsonKind::number) && a.number() == b.number();
    if (a.is(JsonKind::flag)) return b.is(JsonKind::flag) && a.flag() == b.flag();
    return a.is(JsonKind::null) && b.is(JsonKind::null);
}

static void add_shown(Joined& line, Json value) {
    if (value.is(JsonKind::text)) line.add(Cut(value.text(), 40).data);
    else if (value.is(JsonKind::number)) line.add(Digits(value.number()).data);
    else line.add(value.is(JsonKind::flag) ? (value.flag() ? "true" : "false") : value.is(JsonKind::null) ? "null" : "this value");
}

/// Whether a value is the given one, or among those of a given list.
static bool is_known(const Asked& a) {
    Joined line;
    const auto is_met = [&](Json one, const char* before) {
        if (a.says) line.add(before), add_shown(line, one);
        return are_equal(a.value, one);
    };
    if (a.says) {
        const char* mark = a.value.is(JsonKind::text) ? "'" : "";
        line.add(mark), add_shown(line, a.value), line.add(mark), line.add(" is unknown to this reader (it knows ");
    }
    if (!a.given.is(JsonKind::list) && is_met(a.given, "")) return true;
    const char* before = "";
    for (Json one : a.given.items()) {
        if (is_met(one, before)) return true;
        before = ", ";
    }
    line.add(")");
    return a.says && a.set(line.data);
}

/// Where no option fits, the description beside them says why not, or the option that takes such values.
static bool is_any_of(const Asked& a) {
    for (Json one : a.given.items()) {
        if (meets(a.form, a.value, one, false)) return true;
    }
    const Json description = a.part.find("description");
    if (!description.is_missing()) return a.set(Cut(description.text(), 80).data);
    for (Json one : a.given.items()) {
        if (takes_kind(a.value, resolved(a.form, one))) return meets(a.form, a.value, one, a.says);
    }
    return a.fail("another kind of value is needed");
}

static bool refers(const Asked& a) { return meets(a.form, a.value, resolved(a.form, a.part), a.says); }

static bool has_required(const Asked& a) {
    for (Json name : a.given.items()) {
        const Json member = a.value.find(name.text());
        if (!member.is_missing()) continue;
        if (a.says) member.fail(needed_by(a.form, a.part.find("properties").find(name.text())).data);
        return false;
    }
    return true;
}

static bool has_properties(const Asked& a) {
    for (Json member : a.value.entries()) {
        const Json part = a.given.find(member.key());
        if (!part.is_missing() && !meets(a.form, member, part, a.says)) return false;
    }
    return true;
}

static bool has_others(const Asked& a) {
    const Json known = a.part.find("properties");
    for (Json member : a.value.entries()) {
        if (known.find(member.key()).is_missing() && !meets(a.form, member, a.given, a.says)) return false;
    }
    return true;
}

static bool has_items(const Asked& a) {
    for (Json item : a.value.items()) {
        if (!meets(a.form, item, a.given, a.says)) return false;
    }
    return true;
}

static bool is_unique(const Asked& a) {
    Names known;
    if (!known.make(a.form.scratch, a.value.items().size)) return false;
    for (Json item : a.value.items()) {
        if (item.is(JsonKind::text) && !known.add(item.text(), 0)) return a.set("has a name twice");
    }
    return true;
}

/// Whether a count lies between two words of the form.
static bool fits(const Asked& a, uint32_t count, const char* what, const char* least, const char* most) {
    const Json low = a.part.find(least), high = a.part.find(most);
    if ((low.is_missing() || count >= low.number()) && (high.is_missing() || count <= high.number())) return true;
    char line[120];
    if (high.is_missing()) std::snprintf(line, sizeof(line), "has %u %s; at least %.0f are needed", count, what, low.number());
    else std::snprintf(line, sizeof(line), "has %u %s; %.0f to %.0f are taken", count, what, low.is_missing() ? 0 : low.number(), high.number());
    return a.set(line);
}

static bool has_length(const Asked& a) { return fits(a, a.value.items().size, "items", "minItems", "maxItems"); }

static bool has_letters(const Asked& a) {
    const Text text = a.value.text();
    if (text.size == 0 && !a.part.find("minLength").is_missing()) return a.fail(needed_by(a.form, a.part).data);
    return fits(a, letters_of(text), "letters", "minLength", "maxLength");
}

static bool limit(const Asked& a, bool is_met, const char* before, const char* after) {
    if (is_met) return true;
    char line[100];
    const Json low = a.part.find("minimum"), high = a.part.find("maximum");
    std::snprintf(line, sizeof(line), "%s %s is %s", before, Digits(a.given.number()).data, after);
    if (low.given() && high.given()) {
        std::snprintf(line, sizeof(line), "%s to %s are taken", Digits(low.number()).data, Digits(high.number()).data);
    }
    return a.fail(line);
}

static bool is_at_least(const Asked& a) { return limit(a, a.value.number() >= a.given.number(), "at least", "needed"); }
static bool is_at_most(const Asked& a) { return limit(a, a.value.number() <= a.given.number(), "at most", "taken"); }
static bool is_above(const Asked& a) { return limit(a, a.value.number() > a.given.number(), "more than", "needed"); }

static bool has_format(const Asked& a) {
    const Text text = a.value.text();
    if (a.given.text() == "version") return is_version(text) || a.fail("\"MAJOR.MINOR\" is needed");
    bool fits = text.size == 64;
    for (uint32_t i = 0; fits && i < text.size; i++) fits = std::strchr("0123456789abcdef", text.data[i]) != nullptr && text.data[i] != 0;
    return fits || a.fail("64 digits 0-9 and a-f are needed");
}

static constexpr Word words[] = {{text_of("type"), true, {}, has_type},
                             {text_of("enum"), true, {}, is_known},
                             {text_of("const"), true, {}, is_known},
                             {text_of("anyOf"), true, {}, is_any_of},
                             {text_of("$ref"), true, {}, refers},
                             {text_of("required"), false, JsonKind::object, has_required},
                             {text_of("properties"), false, JsonKind::object, has_properties},
                             {text_of("additionalProperties"), false, JsonKind::object, has_others},
                             {text_of("items"), false, JsonKind::list, has_items},
                             {text_of("minItems"), false, JsonKind::list, has_length},
                             {text_of("maxItems"), false, JsonKind::list, has_length},
                             {text_of("uniqueItems"), false, JsonKind::list, is_unique},
                             {text_of("minLength"), false, JsonKind::text, has_letters},
                             {text_of("maxLength"), false, JsonKind::text, has_letters},
                             {text_of("format"), false, JsonKind::text, has_format},
                             {text_of("minimum"), false, JsonKind::number, is_at_least},
                             {text_of("maximum"), false, JsonKind::number, is_at_most},
                             {text_of("exclusiveMinimum"), false, JsonKind::number, is_above}};

static bool meets(const Form& form, Json value, Json part, bool says) {
    for (Json given : part.entries()) {
        for (const Word& word : words) {
            if (word.name != given.key()) continue;
            const bool concerns = word.concerns_all || value.is(word.kind);
            if (concerns && !word.is_met({form, value, part, given, says})) return false;
        }
    }
    return true;
}

void check_form(Json document, Arena& scratch) {
    size_t size = 0;
    for (const char* line : pack_form) size += std::strlen(line);
    Span<char> text = scratch.make<char>(size);
    if (text.empty()) return;
    size = 0;
    for (const char* line : pack_form) {
        const size_t length = std::strlen(line);
        std::memcpy(&text[size], line, length);
        size += length;
    }
    JsonTree tree(scratch, "form");
    if (tree.parse(Text(text.data, size))) meets({Json(tree, scratch.errors()), scratch}, document, Json(tree, scratch.errors()), true);
}

}  // namespace avatar
