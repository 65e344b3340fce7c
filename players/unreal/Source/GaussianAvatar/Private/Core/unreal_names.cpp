#include "unreal_names.h"

#include <cstring>

namespace avatar_unreal {
namespace {

using NameAt = const char* (*)(const AvatarPack* pack, uint32_t index);

char small(char letter) { return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter + 32) : letter; }

bool is_like(const char* a, const char* b) {
    while (*a != 0 && small(*a) == small(*b)) {
        ++a;
        ++b;
    }
    return *a == *b;
}

/// The first of a list of names that is like `name`, or null.
const char* like(const AvatarPack* pack, NameAt name_at, const char* name) {
    for (uint32_t i = 0; name_at(pack, i) != nullptr; ++i) {
        if (is_like(name_at(pack, i), name)) return name_at(pack, i);
    }
    return nullptr;
}

}  // namespace

std::string weight_name(const AvatarPack* pack, const char* name) {
    if (avatar_eyelid_index(pack, name) >= 0 || avatar_expression_index(pack, name) >= 0) return name;
    const char* found = like(pack, avatar_expression_name, name);
    if (found == nullptr) found = like(pack, avatar_eyelid_name, name);
    if (found != nullptr) return found;
    // Other names of expressions cannot be listed. Most of them are ARKit's.
    const int32_t channel = avatar_arkit_channel(name);
    const char* spelled = channel < 0 ? name : avatar_arkit_name(static_cast<uint32_t>(channel));
    return avatar_expression_index(pack, spelled) >= 0 ? spelled : name;
}

std::string joint_name(const AvatarPack* pack, const char* name) {
    if (avatar_joint_index(pack, name) >= 0) return name;
    const char* found = like(pack, avatar_joint_name, name);
    return found != nullptr ? found : name;
}

Names names_of(const AvatarPack* pack) {
    Names found;
    for (uint32_t i = 0; avatar_expression_name(pack, i) != nullptr; ++i) found.weights.push_back(avatar_expression_name(pack, i));
    for (uint32_t i = 0; avatar_eyelid_name(pack, i) != nullptr; ++i) found.weights.push_back(avatar_eyelid_name(pack, i));
    for (uint32_t i = 0; avatar_joint_name(pack, i) != nullptr; ++i) found.joints.push_back(avatar_joint_name(pack, i));
    AvatarClip clip = {};
    for (uint32_t i = 0; avatar_clip(pack, i, &clip) == AVATAR_OK; ++i) found.clips.push_back(clip.name);
    return found;
}

int32_t clip_index(const AvatarPack* pack, const char* name) {
    AvatarClip clip = {};
    int32_t found = -1;
    for (uint32_t i = 0; avatar_clip(pack, i, &clip) == AVATAR_OK; ++i) {
        if (std::strcmp(clip.name, name) == 0) return static_cast<int32_t>(i);
        if (found < 0 && is_like(clip.name, name)) found = static_cast<int32_t>(i);
    }
    return found;
}

}  // namespace avatar_unreal
