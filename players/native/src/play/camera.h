#pragma once
#include "../../include/avatar_player.h"

namespace avatar {

/// Takes a camera of a program. The line for one that cannot be used: none, one with numbers that are not finite, one of
/// an empty image; null for a sound one.
const char* take_camera(const AvatarCamera* given, AvatarCamera& into);

/// Gives a camera the depth of an engine's view and projection [4, 4], of columns. `both_signs`: the projection's depths are
/// -1 to 1, as OpenGL has them; otherwise 0 to 1. The line as above.
const char* set_camera_depth(AvatarCamera* camera, const double* view, const double* projection, bool both_signs);

}  // namespace avatar
