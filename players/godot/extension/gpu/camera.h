// The engine's camera as the passes want it.
#pragma once
#include "../../../native/include/avatar_player.h"
#include "../engine/values.h"

namespace godot {

/// Of where it stands, and of its projection with or without the engine's correction for Vulkan. An orthogonal one becomes
/// one with perspective that shows what is near `middle` the same. Returns null, or a line.
const char* camera_of(const Transform3D& stands, const Projection& projection, const double* middle, Vector2i size,
                      AvatarCamera& out);

}  // namespace godot
