// Copy of players/native/src/formats/near_names.cpp by `python -m avatar_shaders`; do not edit.
// Finds names that are like a wrong one.
#include <cstdio>

#include "text.h"

namespace avatar {

static constexpr size_t most_listed = 8, most_hinted = 3;
static constexpr double near_enough = 0.5;   // least likeness of a near match
static constexpr uint32_t most_letters = 80;  // of a name that are compared and shown

namespace {

/// A line of limited length that is put together.
struct Line {
    char data[360] = "";
    size_t size = 0;

    void add(const char* letters) {
        const int more = std::snprintf(data + size, sizeof(data) - size, "%s", letters);
        size = more < 0 ? size : size + static_cast<size_t>(more);
        if (size >= sizeof(data)) size = sizeof(data) - 1;
    }
};

struct Match {
    const Text* name;
    double likeness;
};

}  // namespace

static char lower(char letter) { return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter; }

/// Pairs of neighbouring letters of a text, its two ends included.
static size_t pairs_of(Text text, uint16_t* into) {
    char before = ' ';
    for (uint32_t i = 0; i <= text.size; i++) {
        const char letter = i < text.size ? lower(text.data[i]) : ' ';
        into[i] = static_cast<uint16_t>(static_cast<unsigned char>(before) << 8 | static_cast<unsigned char>(letter));
        before = letter;
    }
    return text.size + 1;
}

/// How alike two texts are, 0 to 1: the share of pairs of neighbouring letters that both have.
static double likeness(Text a, Text b) {
    uint16_t left[4 * most_letters + 1], right[4 * most_letters + 1];
    const size_t lefts = pairs_of(a, left);
    size_t rights = pairs_of(b, right), shared = 0;
    for (size_t i = 0; i < lefts; i++) {
        for (size_t j = 0; j < rights; j++) {
            if (left[i] != right[j]) continue;
            right[j] = right[--rights];  // each pair counts once
            shared++;
            break;
        }
    }
    return 2.0 * static_cast<double>(shared) / static_cast<double>(a.size + b.size + 2);
}

/// The most alike names, in the order of their likeness; of equal ones the first.
static size_t best_of(Text name, const Text* known, size_t count, Match* best) {
    size_t found = 0;
    const Text wanted = first_letters(name, most_letters);
    for (size_t i = 0; i < count; i++) {
        Match one = {&known[i], likeness(wanted, first_letters(known[i], most_letters))};
        if (one.likeness < near_enough) continue;
        for (size_t at = 0; at < found; at++) {
            if (best[at].likeness >= one.likeness) continue;
            const Match moved = best[at];
            best[at] = one;
            one = moved;
        }
        if (found < most_hinted) best[found++] = one;
    }
    return found;
}

void Errors::set_no_such(Text field, const char* what, Text name, const Text* known, size_t count) {
    if (any_) return;
    Line line;
    Match best[most_hinted];
    const size_t found = best_of(name, known, count, best);
    for (size_t i = 0; i < found; i++) {
        line.add(i == 0 ? "did you mean " : " or ");
        line.add(Cut(*best[i].name, most_letters).data);
    }
    if (found > 0) line.add("?");
    if (found == 0) {
        char counted[48];
        std::snprintf(counted, sizeof(counted), "there are %zu: %s", count, count == 0 ? "none" : "");
        line.add(counted);
        for (size_t i = 0; i < count && i < most_listed; i++) {
            if (i > 0) line.add(", ");
            line.add(Cut(known[i], 32).data);
        }
        if (count > most_listed) line.add(", ...");
    }
    const char* article = std::strchr("aeiouAEIOU", what[0]) != nullptr ? "an" : "a";
    set(field, "'%s' is not %s %s; %s", Cut(name, 40).data, article, what, line.data);
}

}  // namespace avatar
