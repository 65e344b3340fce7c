// The float64 nearest to a number of JSON.
#include <clocale>
#include <cmath>
#include <cstdlib>

#include "json.h"

namespace avatar {

static constexpr int most_digits = 18;      // so that the digits are a whole number of 63 bits
static constexpr int most_power = 22;       // 10 to this is exact in float64
static constexpr int most_exponent = 9999;  // more is infinite or 0 anyway
static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

static int exponent_of(Text text, uint32_t at) {
    const bool is_negative = text.data[at] == '-';
    if (is_negative || text.data[at] == '+') at++;
    int value = 0;
    for (; at < text.size; at++) {
        if (value < most_exponent) value = 10 * value + (text.data[at] - '0');
    }
    return is_negative ? -value : value;
}

/// whole * 10^power, rounded once: computed with twice the digits of a float64.
static double scaled(int64_t whole, int power) {
    const double high = static_cast<double>(whole);
    const double low = static_cast<double>(whole - static_cast<int64_t>(high));
    const double factor = powers[power < 0 ? -power : power];
    if (power >= 0) {
        const double product = high * factor;
        return product + (std::fma(high, factor, -product) + low * factor);
    }
    const double quotient = high / factor;
    return quotient + (std::fma(-quotient, factor, high) + low) / factor;
}

/// By the C library, whose numbers have the locale's point.
static double by_library(Text text, Arena& arena) {
    const Text copied = arena.copy(text);
    if (copied.size < text.size) return NAN;
    char* letters = const_cast<char*>(copied.data);
    char* point = std::strchr(letters, '.');
    if (point != nullptr) *point = *std::localeconv()->decimal_point;
    return std::strtod(letters, nullptr);
}

double parse_number(Text text, Arena& arena) {
    const bool is_negative = text.data[0] == '-';
    uint32_t at = is_negative ? 1 : 0;
    int64_t whole = 0;
    int digits = 0, power = 0;
    bool is_fraction = false;
    for (; at < text.size && text.data[at] != 'e' && text.data[at] != 'E'; at++) {
        if (text.data[at] == '.') {
            is_fraction = true;
            continue;
        }
        if (whole > 0 || text.data[at] != '0') digits++;
        if (digits <= most_digits) whole = 10 * whole + (text.data[at] - '0');
        if (is_fraction) power--;
    }
    if (at < text.size) power += exponent_of(text, at + 1);
    if (digits > most_digits || power < -most_power || power > most_power) return by_library(text, arena);
    const double size = scaled(whole, power);
    return is_negative ? -size : size;
}

}  // namespace avatar
