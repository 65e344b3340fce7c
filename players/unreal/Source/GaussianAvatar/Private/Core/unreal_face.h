#pragma once
#include "avatar_player.h"

namespace avatar_unreal {

/// Sets one channel of a frame by a name as tools spell it ("EyeBlinkLeft", "HeadYaw"): a weight, or an angle in radians.
/// False for a name that is no channel of ARKit.
bool set_channel(AvatarFrame& frame, const char* name, double value);

}  // namespace avatar_unreal
