// The functions of avatar_light.h.
#include "play_handles.h"

using namespace avatar;

bool AvatarInstance::update_light() {
    if (!has_light) return true;
    double placed[16];
    write_placed(placed);
    LightRows rows;
    const Relight& relight = pack.avatar.relight;
    const size_t joints = static_cast<size_t>(pack.avatar.program.pose.joints);
    const float* skin = relight.head < 0 ? nullptr : &poser.pose_floats[joints + 12 * static_cast<size_t>(relight.head)];
    const bool sound = write_light(light, relight, placed, pose.world_from_avatar.data, skin, rows);
    if (!sound) errors.set("light", "is beyond the numbers of float32 where the avatar stands");
    else values.set_light(rows);
    casts = sound && rows.shadow_offset[2] > 0;
    return sound;
}

int avatar_set_light(AvatarInstance* instance, const AvatarLight* light) {
    if (!ready(instance)) return AVATAR_FAILED;
    AvatarLight own;
    const char* line = light == nullptr ? nullptr : take_light(light, own);
    if (line != nullptr) {
        instance->errors.set("light", "%s", line);
    } else if (light != nullptr && !instance->pack.avatar.relight.given) {
        instance->errors.set("light", "its colours hold an unknown light; make it with `pack --relight`");
    }
    if (instance->errors.any()) return AVATAR_FAILED;
    if (light != nullptr) instance->light = own;
    instance->has_light = light != nullptr;
    instance->casts = false;  // until an update
    return AVATAR_OK;
}

int avatar_lighting(const AvatarInstance* instance) {
    if (instance == nullptr || instance->unusable || !instance->has_light) return AVATAR_UNLIT;
    return instance->casts ? AVATAR_SHADOWED : AVATAR_LIT;
}
