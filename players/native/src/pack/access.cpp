#include "access.h"

#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <initializer_list>

namespace avatar {

static const char* const padding = "unused";  // the member that fills a row of four

const Interface* interface_of(Text entry) {
    for (uint32_t i = 0; i < interface_count; i++) {
        if (entry == interfaces[i].entry) return &interfaces[i];
    }
    return nullptr;
}

const PoseSection& Held::section(Text name) const {
    for (const PoseSection& one : pose) {
        if (one.name == name) return one;
    }
    return pose[0];
}

Access::Access(const char* where, Pass& given, const Held& held, Errors& errors)
    : pass(given), held_(held), errors_(errors) {
    std::snprintf(place_, sizeof(place_), "%s (%s)", where, Cut(pass.entry, 40).data);
    declared = interface_of(pass.entry);
    if (declared != nullptr && declared->access == nullptr) declared = nullptr;
}

bool Access::fail(Text what, const char* format, ...) const {
    char where[300], line[400];
    va_list given;
    va_start(given, format);
    std::vsnprintf(line, sizeof(line), format, given);
    va_end(given);
    std::snprintf(where, sizeof(where), "%s, %s", place_, Cut(what, 80).data);
    errors_.set(where, "%s", line);
    return false;
}

const StorageBuffer* Access::storage(Text buffer) const {
    for (const StorageBuffer& one : declared->storage) {
        if (buffer == one.name) return &one;
    }
    return nullptr;
}

static const Member* member_of(const Interface& declared, Text name) {
    for (const Member& one : declared.members) {
        if (name == one.name && name != padding) return &one;
    }
    return nullptr;
}

ConstantType Access::type_of(Text constant) const { return member_of(*declared, constant)->type; }

static void keep_first(Text* best, bool* has, Text name) {
    if (!*has || text_before(name, *best)) *best = name;
    *has = true;
}

bool Access::check_names() {
    if (declared == nullptr) {
        errors_.set(place_, "is no entry that a program may use; a newer version may know it");
        return false;
    }
    for (const bool of_buffers : {true, false}) {
        Text missing, extra;
        bool has_missing = false, has_extra = false;
        if (of_buffers) {
            for (const StorageBuffer& one : declared->storage) {
                if (pass.buffer(one.name) == nullptr) keep_first(&missing, &has_missing, one.name);
            }
            for (const Bound& one : pass.buffers) {
                if (storage(one.name) == nullptr) keep_first(&extra, &has_extra, one.name);
            }
        } else {
            for (const Member& one : declared->members) {
                const Text name = one.name;
                if (name != padding && pass.constant(name) == nullptr) keep_first(&missing, &has_missing, name);
            }
            for (const Constant& one : pass.constants) {
                if (member_of(*declared, one.name) == nullptr) keep_first(&extra, &has_extra, one.name);
            }
        }
        const char* what = of_buffers ? "buffers" : "constants";
        if (has_missing) return fail(what, "%s is missing", Cut(missing, 80).data);
        if (has_extra) return fail(what, "'%s' is not known to this entry", Cut(extra, 80).data);
    }
    return check_buffers();
}

bool Access::is_packed(Text buffer) const {
    for (const SectionContract& one : contract().sections) {
        if (buffer == one.buffer) return true;
    }
    return false;
}

bool Access::check_buffers() {
    for (Bound& one : pass.buffers) {
        const int64_t index = held_.program->buffer_names.find(one.buffer);
        if (index == Names::none) return fail(one.name, "'%s' is no buffer of the program", Cut(one.buffer, 80).data);
        one.index = static_cast<uint32_t>(index);
        const bool packed = is_packed(one.name);
        if (held_.program->buffers[one.index].sections.empty() == packed) {
            const char* needed = packed ? "a buffer with sections" : "a buffer without sections";
            return fail(one.name, "'%s' does not fit; %s is needed", Cut(one.buffer, 80).data, needed);
        }
    }
    return true;
}

double Access::count(Text name) const {
    const Constant* found = pass.constant(name);
    return found == nullptr || found->kind != Constant::Kind::number ? 0 : found->number;
}

bool is_listed(const Table<uint32_t>& known, double value) {
    for (const uint32_t one : known) {
        if (value == one) return true;
    }
    return false;
}

bool Access::applies(const Table<Values>& when) const {
    for (const Values& one : when) {
        if (!is_listed(one.values, count(one.constant))) return false;
    }
    return true;
}

static bool is_float32(double value) { return std::fabs(value) <= most_float32; }

namespace {

/// A constant as a message shows it.
struct Shown {
    char data[260];

    explicit Shown(const Constant& value) {
        if (value.kind == Constant::Kind::vector) std::snprintf(data, sizeof(data), "a list");
        else if (value.kind == Constant::Kind::number) std::snprintf(data, sizeof(data), "%s", Digits(value.number).data);
        else std::snprintf(data, sizeof(data), "'%s'", Cut(value.source, 40).data);
    }
};

}  // namespace

bool Access::check_type(const Constant& value) const {
    const ConstantType type = type_of(value.name);
    const bool is_number = value.kind == Constant::Kind::number;
    if (type == ConstantType::uint) {
        const double number = is_number ? value.number : -1;
        if (number >= 0 && number < u32_end && number == std::floor(number)) return true;
        return fail(value.name, "is %s; a whole number of 32 bits is needed", Shown(value).data);
    }
    if (type == ConstantType::float1) {
        if (is_number && is_float32(value.number)) return true;
        return fail(value.name, "is %s; a finite float32 is needed", Shown(value).data);
    }
    if (value.kind == Constant::Kind::source) return true;
    const uint32_t floats = static_cast<uint32_t>(type);
    bool fits = value.kind == Constant::Kind::vector && value.floats == floats;
    for (uint32_t i = 0; i < value.floats; i++) fits = fits && is_float32(value.vector[i]);
    return fits || fail(value.name, "is %s; %u finite float32 are needed", Shown(value).data, floats);
}

ListedNumbers::ListedNumbers(const Table<uint32_t>& numbers) {
    size_t size = 0;
    data[0] = 0;
    for (uint32_t i = 0; i < numbers.size && size < sizeof(data); i++) {
        const char* gap = i > 0 ? ", " : "";
        size += static_cast<size_t>(std::snprintf(data + size, sizeof(data) - size, "%s%u", gap, numbers.data[i]));
    }
}

bool Access::check_constants() const {
    for (const Constant& one : pass.constants) {
        if (!check_type(one)) return false;
    }
    for (const Values& one : contract().values) {
        if (is_listed(one.values, count(one.constant))) continue;
        const ListedNumbers known(one.values);
        return fail(one.constant, "%s is not known; known are %s", Digits(count(one.constant)).data, known.data);
    }
    for (const Most& one : contract().most) {
        const double value = count(one.constant);
        if (value < 1 || value > one.most) {
            return fail(one.constant, "is %s; 1 to %u are taken", Digits(value).data, one.most);
        }
    }
    return check_ranges();
}

bool Access::check_ranges() const {
    const char* rows = contract().rows;
    if (pass.rows != count(rows)) {
        return fail("rows", "are %s; constant %s is %s", Digits(pass.rows).data, rows, Digits(count(rows)).data);
    }
    for (const NamePair& one : contract().fits) {
        const double value = number(one.first), limit = number(one.second);
        if (failed()) return false;
        if (value > limit) {
            return fail(one.first, "is %s; %s is %s", Digits(value).data, one.second, Digits(limit).data);
        }
    }
    for (const NamePair& one : contract().pose) {
        const double first = held_.section(one.second).first;
        if (count(one.first) == first) continue;
        return fail(one.first, "is %s; %s begins at %s", Digits(count(one.first)).data, one.second, Digits(first).data);
    }
    return true;
}

double Access::number(const char* expression) const {
    double sum = 0, product = 1;
    for (const char* at = expression;; at++) {
        const char* begin = at;
        while (*at != 0 && *at != '+' && *at != '*') at++;
        product *= factor(Text(begin, static_cast<size_t>(at - begin)));
        if (*at == '*') continue;
        sum += product;
        product = 1;
        if (*at == 0) return sum;
    }
}

double Access::factor(Text factor) const {
    if (factor.data[0] >= '0' && factor.data[0] <= '9') {
        double value = 0;
        for (uint32_t i = 0; i < factor.size; i++) value = 10 * value + (factor.data[i] - '0');
        return value;
    }
    if (factor.data[0] != '#') return count(factor);
    const Text name(factor.data + 1, factor.size - 1);
    for (const NamePair& one : contract().pose) {
        if (name == one.first) return held_.section(one.second).items;
    }
    for (const SectionContract& one : contract().sections) {
        Found found = {};
        if (name != one.name || !find(name, one.buffer, &found)) continue;
        return found.packed->rows(found.at).last;
    }
    return 0;
}

double Access::touched_elements(Text buffer) const {
    double most = 0;
    for (const Touched& one : contract().elements) {
        if (buffer != one.buffer || !applies(one.when)) continue;
        const double elements = number(one.elements);
        most = elements > most ? elements : most;
    }
    return most;
}

bool Access::find(Text name, Text buffer, Found* into) const {
    const Bound* bound = pass.buffer(buffer);
    into->packed = &held_.packed[bound->index];
    into->at = into->packed->find(name);
    if (into->at == into->packed->size()) {
        return fail(name, "buffer '%s' has no section of that name", Cut(bound->buffer, 80).data);
    }
    const double begins = into->packed->offset(into->at);
    if (count(name) == begins) return true;
    return fail(name, "is %s; the section begins at word %s", Digits(count(name)).data, Digits(begins).data);
}

}  // namespace avatar
