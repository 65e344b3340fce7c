// The sections that a pass reads, against the contract of its entry.
#include <cmath>
#include <cstdio>

#include "access.h"

namespace avatar {

static constexpr double most_scale = 1e30;  // of a float that codes are multiplied by: any product is finite

double Access::check_sections() const {
    double entries = 0;
    for (const SectionContract& one : contract().sections) {
        if (!applies(one.when)) continue;
        if (!check_section(one)) return 0;
        if (one.kind != SectionKind::pointer) continue;
        Found found = {};
        if (!find(one.name, one.buffer, &found)) return 0;
        entries += found.packed->rows(found.at).last;
    }
    return entries;
}

bool Access::check_section(const SectionContract& expected) const {
    const Text name = expected.name;
    Found found = {};
    if (!find(name, expected.buffer, &found)) return false;
    const double wanted = number(expected.elements);
    if (failed()) return false;
    const double width = expected.width == nullptr ? 32 : count(expected.width);
    if (!is_listed(expected.widths, width)) {
        const Text what = expected.width == nullptr ? name : Text(expected.width);
        return fail(what, "is %s; known are %s", Digits(width).data, ListedNumbers(expected.widths).data);
    }
    if (width > 0) {
        if (!check_length(expected, found.packed->section(found.at), width, wanted)) return false;
    } else if (expected.kind != SectionKind::signed_ && wanted > 0 &&
               found.packed->offset(found.at) >= found.packed->words()) {
        return fail(name, "begins at the end of its buffer; one word is read at width 0");
    }
    return check_kind(expected, found, width);
}

bool Access::check_length(const SectionContract& expected, const Section& section, double width, double wanted) const {
    const Text name = expected.name;
    const Elements& elements = section.elements;
    if (elements.bits != width) {
        return fail(name, "has elements of %u bits; %.0f are stated", elements.bits, width);
    }
    if (elements.length != wanted) {
        return fail(name, "has %u elements; %s are needed", elements.length, Digits(wanted).data);
    }
    if (width < 32 && wanted * width >= u32_end) {
        return fail(name, "has %.0f elements of %.0f bits; their bits exceed a 32-bit index", wanted, width);
    }
    return true;
}

bool Access::check_kind(const SectionContract& expected, const Found& found, double width) const {
    const Text name = expected.name;
    if (expected.kind == SectionKind::pointer) {
        const PointerRows& rows = found.packed->rows(found.at);
        if (!rows.rises) return fail(name, "does not begin with 0, or falls");
        if (rows.longest <= expected.pointer) return true;
        return fail(name, "gives a row %.0f entries; %u are the most", rows.longest, expected.pointer);
    }
    if (expected.kind == SectionKind::index) {
        const double end = number(expected.below);
        return !failed() && check_below(name, found.packed->largest(found.at), end);
    }
    if (width == 32) {
        return found.packed->is_finite(found.at) || fail(name, "holds a float that is not finite");
    }
    return check_scale(expected, found, width);
}

bool Access::check_below(Text name, double largest, double end) const {
    return largest < end || fail(name, "holds %.0f; less than %s is needed", largest, Digits(end).data);
}

bool Access::check_scale(const SectionContract& expected, const Found& found, double width) const {
    const Text scale = expected.scale;
    Found floats = {};
    if (!find(scale, expected.buffer, &floats)) return false;
    const Elements& held = floats.packed->section(floats.at).elements;
    const double length = held.length;
    const double wanted = expected.floats == nullptr ? (length > 1 ? length : 1) : number(expected.floats);
    if (failed()) return false;
    if (held.bits != 32 || length != wanted) {
        return fail(scale, "has %.0f elements; %s of 32 bits are needed", length, Digits(wanted).data);
    }
    if (!floats.packed->is_finite(floats.at, most_scale)) {
        return fail(scale, "holds a float that is not finite or exceeds 1e+30");
    }
    if (expected.kind != SectionKind::table) return true;
    return check_below(expected.name, width > 0 ? found.packed->largest(found.at) : 0, length);
}

}  // namespace avatar
