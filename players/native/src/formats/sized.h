#pragma once
#include <cstring>

#include "../../include/avatar_player.h"

namespace avatar {

// Structs of the interface as a program has them: it may have been compiled with fewer or more fields than this library.
// A new field begins where the struct ended before, padding and all: what an older program has there is not set.

constexpr uint32_t largest_struct = 4096;  // bytes; memory that was never set seldom says less
constexpr const char* not_sized = "struct_size must be the size of the struct, as sizeof gives it";

/// The bytes of a struct that its owner says it has; 0: it is null, or says nothing of use.
inline uint32_t size_of(const void* given) {
    uint32_t size = 0;
    if (given != nullptr) std::memcpy(&size, given, sizeof(size));
    return size < sizeof(size) || size > largest_struct ? 0 : size;
}

/// Takes what a program gives; fields that it does not have are 0. False where size_of is 0.
template <class T>
bool take(const T* given, T& into) {
    const uint32_t size = size_of(given);
    std::memset(static_cast<void*>(&into), 0, sizeof(T));
    if (size > 0) std::memcpy(static_cast<void*>(&into), static_cast<const void*>(given), size < sizeof(T) ? size : sizeof(T));
    into.struct_size = sizeof(T);
    return size > 0;
}

/// Fills what a program has; fields that are not known here become 0. Returns AVATAR_OK, or AVATAR_FAILED where size_of is 0.
template <class T>
int give(const T& made, T* out) {
    const uint32_t size = size_of(out);
    if (size == 0) return AVATAR_FAILED;
    char* to = reinterpret_cast<char*>(out);
    constexpr uint32_t head = sizeof(uint32_t);
    std::memset(to + head, 0, size - head);
    std::memcpy(to + head, reinterpret_cast<const char*>(&made) + head, (size < sizeof(T) ? size : sizeof(T)) - head);
    return AVATAR_OK;
}

/// Sets what a program has to 0, where there is nothing to give it.
template <class T>
int refuse(T* out) {
    give(T{}, out);
    return AVATAR_FAILED;
}

}  // namespace avatar
