#pragma once
#include "../../include/avatar_player.h"

namespace avatar {

/// Takes a camera of a program. The line for one that cannot be used: none, one with numbers that are not finite, one of
/// an empty image; null for a sound one.
const char* take_camera(const AvatarCamera* given, AvatarCamera& into);

}  // namespace avatar
