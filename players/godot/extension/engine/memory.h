// Memory of this add-on: counted, so that a test sees a frame that allocates.
#pragma once
#include "../../../native/include/avatar_player.h"

namespace godot {

/// malloc, counted.
const AvatarAllocator& counted_allocator();

/// How often this add-on has asked for memory.
uint64_t allocations();

}  // namespace godot
