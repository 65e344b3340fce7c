// Copy of players/native/src/play/camera.h by `python -m avatar_shaders`; do not edit.
#pragma once
#include "../../include/avatar_player.h"

namespace avatar {

/// The line for a camera that cannot be used: none, one with numbers that are not finite, one of an empty image. Null for
/// a sound one.
const char* wrong_with(const AvatarCamera* camera);

}  // namespace avatar
