#include "memory.h"

#include <atomic>
#include <cstdlib>
#include <new>

namespace godot {

static std::atomic<uint64_t> count{0};

static void* counted(size_t bytes) {
    count.fetch_add(1, std::memory_order_relaxed);
    return std::malloc(bytes);
}

const AvatarAllocator& counted_allocator() {
    static const AvatarAllocator made = {
        sizeof(AvatarAllocator), [](void*, size_t bytes) { return counted(bytes); },
        [](void*, void* memory, size_t) { std::free(memory); }, nullptr};
    return made;
}

uint64_t allocations() { return count.load(std::memory_order_relaxed); }

}  // namespace godot
