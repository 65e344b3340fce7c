// Copy of players/native/src/formats/finite.h by `python -m avatar_shaders`; do not edit.
#pragma once
#include <cfloat>
#include <cmath>
#include <cstddef>

namespace avatar {

/// Whether all numbers are finite and not beyond float32.
template <class T>
bool all_finite(const T* numbers, size_t count) {
    bool finite = true;
    for (size_t i = 0; i < count; i++) finite &= std::fabs(numbers[i]) <= static_cast<T>(FLT_MAX);
    return finite;
}

}  // namespace avatar
