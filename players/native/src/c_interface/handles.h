#pragma once
#include <new>

#include "../formats/finite.h"
#include "../pack/read.h"

namespace avatar {

/// What every handle begins with: its memory and its error.
struct HandleBase {
    explicit HandleBase(const AvatarAllocator& given) : allocator(given), arena(given, errors) {}

    AvatarAllocator allocator;
    Errors errors;
    Arena arena;

    /// Whether its making failed: then no function uses it.
    bool unusable = false;
};

/// A new handle, made of the allocator that the caller gave; null where there is no memory.
template <class T, class... Given>
T* open_handle(const AvatarAllocator* given, Given&&... more) {
    const AvatarAllocator allocator = allocator_or_default(given);
    if (allocator.allocate == nullptr || allocator.release == nullptr) return nullptr;
    void* memory = allocator.allocate(allocator.user, sizeof(T));
    return memory == nullptr ? nullptr : new (memory) T(allocator, static_cast<Given&&>(more)...);
}

/// Gives a handle back; null is taken.
template <class T>
void close_handle(T* handle) {
    if (handle == nullptr) return;
    const AvatarAllocator allocator = handle->allocator;
    handle->~T();
    allocator.release(allocator.user, handle, sizeof(T));
}

/// The line of a handle; one where there is no handle.
inline const char* line_of(const HandleBase* handle) {
    return handle == nullptr ? "there is no handle: NULL was given, or there was no memory for it" : handle->errors.line();
}

/// A text of the interface: null where it is empty.
inline const char* or_null(Text text) { return text.size == 0 ? nullptr : text.data; }

}  // namespace avatar

struct AvatarPack : avatar::HandleBase {
    using HandleBase::HandleBase;

    avatar::Avatar avatar = {};
};
