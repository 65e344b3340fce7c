#include <cmath>
#include <cstdio>

#include "../formats/json.h"
#include "recording.h"

namespace avatar {

static constexpr double day = 86400;     // seconds
static constexpr double most_value = 100;  // weights are in 0..1 and angles in -pi..pi; larger values are errors
static constexpr uint32_t most_letters_shown = 40, most_header_shown = 60;
static constexpr int default_rate = 60;  // of a file that stays within one second
static const int common_rates[] = {24, 25, 30, 48, 50, 60, 120, 240};

namespace {

/// A frame's time of day: whole seconds, frames into the second, and the line that says so.
struct Code {
    double seconds, frames;
    uint32_t line;
};

/// Which column holds what; -1: none.
struct Columns {
    int64_t time = -1, count = -1, channels[arkit_channels];

    bool read(const CsvRow& header, Errors& errors);
};

}  // namespace

static bool same_small(Text field, Text small_name) {
    if (field.size != small_name.size) return false;
    for (uint32_t i = 0; i < field.size; i++) {
        const char letter = field.data[i];
        if ((letter >= 'A' && letter <= 'Z' ? letter + 32 : letter) != small_name.data[i]) return false;
    }
    return true;
}

bool Columns::read(const CsvRow& header, Errors& errors) {
    for (int64_t& one : channels) one = -1;
    bool any = false;
    for (size_t at = 0; at < header.fields.size; at++) {
        const Text plain = trimmed(header.fields[at]);
        int64_t* place = nullptr;
        const char* name = "timecode";
        if (same_small(plain, "timecode")) {
            place = &time;
        } else if (same_small(plain, "blendshapecount")) {
            place = &count;
            name = "blendshapecount";
        } else {
            const int channel = channel_of(plain);
            if (channel < 0) continue;
            place = &channels[channel];
            name = arkit_names[channel];
            any = true;
        }
        if (*place >= 0) {
            errors.set("", "line %u: columns %lld and %zu are both %s", header.line, static_cast<long long>(*place) + 1,
                       at + 1, name);
            return false;
        }
        *place = static_cast<int64_t>(at);
    }
    if (time < 0) errors.set("", "line %u: has no Timecode column; a Live Link Face CSV is needed", header.line);
    if (!any && !errors.any()) {
        char field[32], listed[300];
        size_t size = 0;
        listed[0] = 0;
        for (size_t i = 0; i < header.fields.size && size < sizeof(listed); i++) {
            const char* gap = i > 0 ? ", " : "";
            const Cut shown(header.fields[i], most_header_shown);
            size += static_cast<size_t>(std::snprintf(listed + size, sizeof(listed) - size, "%s%s", gap, shown.data));
        }
        Text known[arkit_channels];
        for (int i = 0; i < arkit_channels; i++) known[i] = arkit_names[i];
        std::snprintf(field, sizeof(field), "line %u", header.line);
        errors.set_no_such(field, "ARKit column", Cut(listed, most_header_shown).data, known, arkit_channels);
    }
    return !errors.any();
}

/// Whether a text is a number as people write it: "+1.", ".5", "2e-3".
static bool is_number(Text text) {
    uint32_t at = 0, digits = 0;
    const auto skip = [&] {
        const uint32_t begin = at;
        while (at < text.size && text.data[at] >= '0' && text.data[at] <= '9') at++;
        return at - begin;
    };
    if (at < text.size && (text.data[at] == '+' || text.data[at] == '-')) at++;
    digits = skip();
    if (at < text.size && text.data[at] == '.') {
        at++;
        digits += skip();
    }
    if (digits == 0) return false;
    if (at < text.size && (text.data[at] == 'e' || text.data[at] == 'E')) {
        at++;
        if (at < text.size && (text.data[at] == '+' || text.data[at] == '-')) at++;
        if (skip() == 0) return false;
    }
    return at == text.size;
}

static double number_of(const CsvRow& row, size_t at, Text name, Arena& arena) {
    const Text text = trimmed(row.fields[at]);
    double value = NAN;
    if (is_number(text)) {
        const uint32_t sign = text.data[0] == '+' ? 1 : 0;
        value = parse_number(Text(text.data + sign, text.size - sign), arena);
    }
    if (std::fabs(value) <= most_value) return value;
    arena.errors().set(trimmed(name), "line %u: '%s' is not a weight or an angle in radians", row.line,
                       Cut(text, most_letters_shown).data);
    return 0;
}

/// Digits at `at`, at least one and at most `most`; -1 where there are none.
static double part_of(Text text, uint32_t* at, uint32_t most) {
    const uint32_t begin = *at;
    double value = 0;
    while (*at < text.size && *at - begin < most && text.data[*at] >= '0' && text.data[*at] <= '9') {
        value = 10 * value + (text.data[(*at)++] - '0');
    }
    return *at > begin ? value : -1;
}

static bool is_mark(Text text, uint32_t* at, const char* marks) {
    if (*at >= text.size || text.data[*at] == 0 || std::strchr(marks, text.data[*at]) == nullptr) return false;
    (*at)++;
    return true;
}

static Code code_of(Text field, uint32_t line, Arena& arena) {
    const Text text = trimmed(field);
    uint32_t at = 0;
    const double hours = part_of(text, &at, 2);
    bool fits = hours >= 0 && is_mark(text, &at, ":");
    const double minutes = fits ? part_of(text, &at, 2) : -1;
    fits = minutes >= 0 && is_mark(text, &at, ":");
    const double seconds = fits ? part_of(text, &at, 2) : -1;
    fits = seconds >= 0 && is_mark(text, &at, ":;");
    const uint32_t begin = at;
    fits = fits && part_of(text, &at, 3) >= 0;
    if (fits && at < text.size) fits = is_mark(text, &at, ".") && part_of(text, &at, 9) >= 0 && at == text.size;
    const Cut shown(text, most_letters_shown);
    if (!fits) {
        arena.errors().set("Timecode", "line %u: '%s' is not a timecode HH:MM:SS:FF.sss", line, shown.data);
        return {};
    }
    const double frames = parse_number(Text(text.data + begin, text.size - begin), arena);
    if (hours > 23 || minutes > 59 || seconds > 59 || frames >= 240) {
        arena.errors().set("Timecode", "line %u: '%s' is not a time of day", line, shown.data);
    }
    return {3600 * hours + 60 * minutes + seconds, frames, line};
}

/// Seconds from the first frame; midnight may be crossed once.
static Span<double> times_of(const Grown<Code>& codes, Arena& arena) {
    double highest = 0;
    bool crosses = false;
    for (size_t i = 0; i < codes.size(); i++) {
        highest = codes[i].frames > highest ? codes[i].frames : highest;
        crosses |= codes[i].seconds != codes[0].seconds;
    }
    int rate = 0;
    for (const int one : common_rates) {
        if (rate == 0 && one > highest && (crosses || one >= default_rate)) rate = one;
    }
    Span<double> times = arena.make<double>(codes.size());
    size_t midnight = 0, midnights = 0;
    for (size_t i = 0; i < times.size; i++) {
        times[i] = codes[i].seconds + codes[i].frames / rate;
        if (i == 0 || times[i] - times[i - 1] >= -day / 2) continue;
        midnight = i;
        midnights++;
    }
    for (size_t i = midnight; i < times.size && midnights == 1; i++) times[i] += day;
    const double first = times.empty() ? 0 : times[0];
    for (size_t i = 1; i < times.size; i++) {
        if (times[i] < times[i - 1]) {
            arena.errors().set("Timecode", "line %u is earlier than the one before", codes[i].line);
        }
    }
    for (double& time : times) time -= first;
    return times;
}

void read_live_link_csv(Text text, Recording& into, Arena& arena) {
    Errors& errors = arena.errors();
    Arena scratch(arena.allocator(), errors);
    Csv csv(text.size == 0 ? Text("\n") : text, scratch);
    Grown<Code> codes(arena.allocator(), errors);
    Grown<double> channels(arena.allocator(), errors);
    CsvRow row = {};
    Columns columns;
    if (!csv.next(&row) || !columns.read(row, errors)) return;
    const Span<Text> header = scratch.copy(row.fields.data, row.fields.size);
    while (!errors.any() && csv.next(&row)) {
        if (row.fields.empty()) continue;
        if (row.fields.size != header.size) {
            errors.set("", "line %u has %zu fields, but the header has %zu", row.line, row.fields.size, header.size);
            return;
        }
        if (columns.count >= 0 && trimmed(row.fields[static_cast<size_t>(columns.count)]) == "0") {
            into.without_face++;
            continue;
        }
        if (!codes.add(code_of(row.fields[static_cast<size_t>(columns.time)], row.line, scratch))) return;
        for (const int64_t at : columns.channels) {
            const size_t field = static_cast<size_t>(at);
            if (!channels.add(at < 0 ? 0 : number_of(row, field, header[field], scratch))) return;
        }
    }
    if (codes.size() == 0) errors.set("", "has no frame with a face");
    if (errors.any()) return;
    into.times = times_of(codes, arena);
    into.channels = arena.copy(channels.data(), channels.size());
    if (!errors.any()) into.fps = rate_of(into.times, scratch);
}

}  // namespace avatar
