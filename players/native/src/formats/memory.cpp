#include "memory.h"

#include <chrono>
#include <cstdlib>

#include "sized.h"

namespace avatar {

static void* take_memory(void*, size_t bytes) { return std::malloc(bytes); }

static void give_memory(void*, void* memory, size_t) { std::free(memory); }

AvatarAllocator allocator_or_default(const AvatarAllocator* given) {
    AvatarAllocator made = {sizeof(AvatarAllocator), take_memory, give_memory, nullptr};
    if (given != nullptr) take(given, made);
    return made;
}

static constexpr size_t arena_align = 16;
static constexpr size_t most_block = 1 << 18;

Arena::~Arena() {
    while (newest_ != nullptr) {
        Block* before = newest_->before;
        allocator_.release(allocator_.user, newest_, newest_->bytes);
        newest_ = before;
    }
}

void* Arena::take(size_t bytes) {
    bytes = (bytes + arena_align - 1) / arena_align * arena_align;
    if (bytes == 0) bytes = arena_align;  // so that an empty list is no lack of memory
    char* taken = next_;
    if (bytes > left_) {
        const bool own = bytes > block_bytes_ / 4;  // a large piece has a block of its own size
        taken = grow(own ? bytes : block_bytes_);
        if (taken == nullptr) return nullptr;
        if (!own) {
            next_ = taken;
            left_ = block_bytes_;
            if (block_bytes_ < most_block) block_bytes_ *= 2;
        }
    }
    if (taken == next_) {
        next_ += bytes;
        left_ -= bytes;
    }
    return taken;
}

/// The memory of a new block; null where there is none.
char* Arena::grow(size_t bytes) {
    constexpr size_t head = (sizeof(Block) + arena_align - 1) / arena_align * arena_align;
    Block* made = static_cast<Block*>(allocator_.allocate(allocator_.user, head + bytes));
    if (made == nullptr) {
        errors_.set_memory();
        return nullptr;
    }
    made->bytes = head + bytes;
    made->before = newest_;
    newest_ = made;
    return reinterpret_cast<char*>(made) + head;
}

Text Arena::copy(Text text) {
    Span<char> made = make<char>(static_cast<size_t>(text.size) + 1);
    if (made.empty()) return {};
    if (text.size > 0) std::memcpy(made.data, text.data, text.size);
    return Text(made.data, text.size);
}

static uint32_t seed_of_run() {
    const auto now = std::chrono::steady_clock::now().time_since_epoch().count();
    const auto place = reinterpret_cast<uintptr_t>(&take_memory);
    return static_cast<uint32_t>(now) ^ static_cast<uint32_t>(place >> 4) ^ 0x9e3779b1u;
}

uint32_t hash_of(Text name) {
    static const uint32_t seed = seed_of_run();
    uint32_t hash = seed;
    for (uint32_t i = 0; i < name.size; i++) {
        hash = (hash ^ static_cast<unsigned char>(name.data[i])) * 0x9e3779b1u;
        hash ^= hash >> 15;
    }
    return hash;
}

bool Names::make(Arena& arena, size_t most) {
    size_t slots = 4;
    while (slots < 2 * most) slots *= 2;
    slots_ = arena.make<Slot>(slots);
    return !slots_.empty();
}

Names::Slot* Names::slot(Text name) const {
    size_t at = hash_of(name) & (slots_.size - 1);
    while (slots_[at].used && slots_[at].name != name) at = (at + 1) & (slots_.size - 1);
    return &slots_[at];
}

bool Names::add(Text name, uint32_t number) {
    if (slots_.empty()) return true;  // no memory: the error is set
    Slot* found = slot(name);
    if (found->used) return false;
    *found = Slot{name, number, true};
    return true;
}

uint32_t* Names::place(Text name) const {
    if (slots_.empty()) return nullptr;
    Slot* found = slot(name);
    return found->used ? &found->number : nullptr;
}

int64_t Names::find(Text name) const {
    const uint32_t* found = place(name);
    return found == nullptr ? none : static_cast<int64_t>(*found);
}

}  // namespace avatar
