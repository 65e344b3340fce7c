#pragma once
#include "../gles/avatar_gles.h"

/// Prints what a scene that has drawn nothing makes of calls that come too early.
void refused_early(AvatarGles* gles);

/// Prints a line for each call that must be refused. `instance` of `pack` is in the scene; `other` is another pack.
/// `colour` is a texture without depth, `small_depth` one of 3x2 pixels.
void refused_arguments(AvatarGles* gles, const AvatarCamera& camera, const AvatarPack* pack, AvatarInstance* instance, const AvatarPack* other,
                       uint32_t colour, uint32_t small_depth);
