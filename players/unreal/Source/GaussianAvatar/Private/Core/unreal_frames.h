#pragma once
#include "avatar_player.h"

namespace avatar_unreal {

// Unreal counts centimetres in a left-handed frame: +X forward, +Y right, +Z up. The player counts metres in the person's
// frame, right-handed for every pack: +Y up, the face looks along +Z. The face of an avatar looks along +X of its
// component, as Unreal's characters do.
// The scene that the player draws has Unreal's axes, counts metres and begins at the eye: so no number is large, however
// far an actor is from the origin of the level.
// Matrices of Unreal (FMatrix) are for row vectors; those of the player are for column vectors.

constexpr double centimetres = 100;  // in a metre

/// Where an avatar stands in the scene of one eye: scene from avatar, [4, 4].
/// `unreal_from_component` is the FMatrix of the component's transform, row-major [4, 4]; `eye` [3] in Unreal's world.
void scene_from_avatar(const double* unreal_from_component, const double* eye, double* into);

/// A rotation of Unreal (FQuat: x, y, z, w [4], of any length but 0) as a rotation vector [3] in the person's frame,
/// radians, the shorter way round.
void person_rotation(const double* xyzw, double* into);

/// The box [3], [3] of a person in the component's frame: lowest and highest corner in centimetres.
void component_box(const double* low, const double* high, double* into_low, double* into_high);

/// The same of a pack's bounds over all poses.
void pack_box(const AvatarPack* pack, double* into_low, double* into_high);

/// The camera of a view of Unreal in the scene of its eye. `view_rotation` and `projection` are FMatrix, row-major: view
/// axes are x right, y up, z forward, and the depth is what Unreal's depth buffer holds. False where the projection
/// has no perspective or the image is empty; then nothing is written.
bool camera_of_view(const double* view_rotation, const double* projection, int32_t width, int32_t height,
                    AvatarCamera* into);

}  // namespace avatar_unreal
