#pragma once
#include "../../include/avatar_light.h"
#include "../pack/model.h"

namespace avatar {

/// A light as kernels take it, in the order of frame_sources. Rows that are not set are 0.
struct LightRows {
    float ambient[9][4];     // rgb, 0
    float place[4][4];       // xyz towards the light and 0, or its position and 1
    float colour[4][4];      // rgb, 0; black where there is no light
    float turn[3][4];        // frame that the light of the capture moves with from world, a rotation; 0
    float shadow_row[4][4];  // column, row, distance and w of the shadow map, from world
    float shadow_offset[4];  // along the normal, along the light, 1 where there is a shadow map, 0
};

/// Takes the light of a program. The line for one that cannot be used; null for a sound one.
const char* take_light(const AvatarLight* given, AvatarLight& into);

/// The numbers of a light of the scene, seen from the pack's own space: `placed` [4, 4] places the pack in the scene, and the
/// avatar stands at `posed` [4, 4] in the pack's space. A place that scales evenly or mirrors is exact; one without an inverse
/// has no light. `skin` [3, 4]: of the joint of `relight`; null: there is none. False for numbers beyond float32.
bool write_light(const AvatarLight& light, const Relight& relight, const double* placed, const double* posed,
                 const float* skin, LightRows& into);

}  // namespace avatar
