// Compares outputs with the reference, element by element.
#include <cmath>

#include "reference.h"

namespace avatar {

static constexpr double flip_step = 4e-3;  // of the brightest colour: what a pixel may be off at the cut-off of alpha

/// Whether one side alone draws a row. `got` may be null: then nothing is drawn.
static bool drawn_in_one(const Expected* radius, const Named* got, size_t row) {
    if (radius == nullptr || got == nullptr || got->values.size != radius->values.size) return false;
    return row < got->values.size && (radius->values[row] > 0) != (got->values[row] > 0);
}

static double larger(double most, double one) { return one > most || std::isnan(one) ? one : most; }

static Verdict compared(const double* got, const double* want, size_t width, double atol, double rtol, double sign) {
    Verdict found = {};
    for (size_t i = 0; i < width; i++) {
        const double off = std::fabs(sign * got[i] - want[i]), allowed = atol + rtol * std::fabs(want[i]);
        const double share = allowed > 0 ? off / allowed : off == 0 ? 0 : INFINITY;
        found.used = std::fmax(found.used, std::isnan(share) ? INFINITY : share);
        found.error = larger(found.error, off);
    }
    return found;
}

static bool flipped(const Expected& expected, double got, size_t row, double error, double brightest) {
    if (expected.flips == "shadow") return true;
    if (expected.flips == "drawn") return error == 1 || got == 0 || expected.values[row] == 0;
    return expected.flips == "cutoff" && error <= flip_step * brightest;
}

static double brightest_of(const Step& step) {
    const Named* rgb = step.inputs.find("rgb");
    double most = 1;
    for (size_t i = 0; rgb != nullptr && i < rgb->values.size; i++) most = std::fmax(most, std::fabs(rgb->values[i]));
    return most;
}

Verdict judge(const Step& step, const Expected& expected, const Arrays& got) {
    const Named* have = got.find(expected.name);
    if (have == nullptr || have->values.size != expected.values.size) return {INFINITY, INFINITY, 0, false};
    const Expected* radius = nullptr;
    for (const Expected& one : step.outputs) {
        if (one.name == "radius") radius = &one;
    }
    const Named* got_radius = got.find("radius");
    const double brightest = brightest_of(step);
    const size_t width = expected.rows == 0 ? 0 : expected.values.size / expected.rows;
    Verdict found = {};
    for (size_t row = 0; row < expected.rows; row++) {
        if (expected.flips != "drawn" && drawn_in_one(radius, got_radius, row)) continue;
        const double atol = expected.atol * (expected.has_weight ? expected.weight[row] : 1);
        const double *mine = have->values.data + row * width, *want = expected.values.data + row * width;
        Verdict best = compared(mine, want, width, atol, expected.rtol, 1);
        if (expected.flips == "sign") {
            const Verdict other = compared(mine, want, width, atol, expected.rtol, -1);
            if (other.used < best.used) best = other;
        }
        if (best.used > 1 && width > 0 && flipped(expected, mine[0], row, best.error, brightest)) {
            found.flips++;
            continue;
        }
        found.error = larger(found.error, best.error);
        found.used = std::fmax(found.used, best.used);
    }
    found.passed = found.used <= 1 && found.flips <= expected.most_flips;
    return found;
}

}  // namespace avatar
