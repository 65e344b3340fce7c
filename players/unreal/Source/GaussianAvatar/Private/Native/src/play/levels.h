// Copy of players/native/src/play/levels.h by `python -m avatar_shaders`; do not edit.
#pragma once
#include "../../include/avatar_player.h"
#include "../pack/model.h"

namespace avatar {

/// The physical pixels that a length of `whole.size[1]` covers, facing the camera, at `whole.target`; how avatar and camera
/// are turned does not matter. `world` [4, 4] places the avatar. Infinite where the target is not before the camera.
double height_px(const FramedPart& whole, const double* world, const AvatarCamera& camera);

/// The coarsest level that serves a height: level i from 1 on serves heights up to its own.
uint32_t level_for(Span<LevelInfo> levels, double height);

/// The level to show after `level`: it stays where the height is within a tenth of its borders.
uint32_t next_level(Span<LevelInfo> levels, double height, uint32_t level);

}  // namespace avatar
