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

/// The name of a list that is like `name`, or `name`.
std::string like(const AvatarPack* pack, NameAt name_at, const char* name) {
    for (uint32_t i = 0; name_at(pack, i) != nullptr; ++i) {
        if (is_like(name_at(pack, i), name)) return name_at(pack, i);
    }
    return name;
}

std::vector<std::string> all(const AvatarPack* pack, NameAt name_at) {
    std::vector<std::string> found;
    for (uint32_t i = 0; name_at(pack, i) != nullptr; ++i) found.push_back(name_at(pack, i));
    return found;
}

}  // namespace

std::string expression_name(const AvatarPack* pack, const char* name) {
    if (avatar_expression_index(pack, name) >= 0) return name;  // also by another name
    const std::string found = like(pack, avatar_expression_name, name);
    if (found != name) return found;
    // Other names of expressions cannot be listed. Most of them are ARKit's.
    const int32_t channel = avatar_arkit_channel(name);
    const char* spelled = channel < 0 ? name : avatar_arkit_name(static_cast<uint32_t>(channel));
    return avatar_expression_index(pack, spelled) >= 0 ? spelled : name;
}

std::string eyelid_name(const AvatarPack* pack, const char* name) {
    return avatar_eyelid_index(pack, name) >= 0 ? name : like(pack, avatar_eyelid_name, name);
}

std::string joint_name(const AvatarPack* pack, const char* name) {
    return avatar_joint_index(pack, name) >= 0 ? name : like(pack, avatar_joint_name, name);
}

Names names_of(const AvatarPack* pack) {
    Names found = {all(pack, avatar_expression_name), all(pack, avatar_eyelid_name), all(pack, avatar_joint_name), {}};
    AvatarClip clip;
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
