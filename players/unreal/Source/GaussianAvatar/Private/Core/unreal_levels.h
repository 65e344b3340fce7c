#pragma once
#include "avatar_player.h"

namespace avatar_unreal {

/// How high a box of the pack, corners [3] and [3], is in the image of a camera, pixels. 0 where it lies behind the
/// camera; a height beyond every level where the camera is in its depth.
double height_px(const double* low, const double* high, const double* scene_from_avatar, const AvatarCamera& camera);

/// The level for an avatar that is so many pixels high and shows `current` now. It stays where it is within a tenth of
/// a border, so that an avatar at the border does not flicker.
uint32_t level_of(const AvatarPack* pack, double height, uint32_t current);

}  // namespace avatar_unreal
