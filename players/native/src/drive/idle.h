#pragma once
#include "../formats/memory.h"

namespace avatar {

/// Writes what a person does who only sits there at a time: breathes, blinks, looks about. It depends on the time, which
/// may be any, and on the seed alone. The same numbers as avatar_runtime.driving.idle.
void write_idle(double seconds, uint32_t seed, AvatarFrame& frame);

}  // namespace avatar
