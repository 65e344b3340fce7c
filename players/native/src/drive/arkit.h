#pragma once
#include "../formats/text.h"

namespace avatar {

constexpr int arkit_shapes = 52, arkit_channels = 61;
constexpr double radians_per_eye_weight = 0.609;  ///< rotation of an eye by one unit of an eyeLook weight

/// ARKit's names [52], in the order of a Live Link Face packet, then yaw, pitch and roll of head, leftEye and rightEye.
/// Left and right are the subject's, except in the names of the eye channels.
extern const char* const arkit_names[arkit_channels];

/// The channel that a name spells; -1: none. Case, underscores, prefixes of tools ("BS_node.", "AK_01_"), "_L" and "_R"
/// for Left and Right, and the halves of browInnerUp and cheekPuff are understood.
int channel_of(Text name);

/// The place of exactly this name of ARKit's blendshapes; -1: none.
int shape_of(Text name);

/// A text without spaces at its ends.
Text trimmed(Text text);

}  // namespace avatar
