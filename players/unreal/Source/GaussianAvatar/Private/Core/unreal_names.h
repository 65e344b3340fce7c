#pragma once
#include <string>
#include <vector>

#include "avatar_player.h"

namespace avatar_unreal {

// An FName has the spelling with which a program first made it, whichever that was: packaged games do not keep another
// one. So names that come from Unreal are compared without case, and the pack's own spelling is used from then on.

/// A name as the pack spells it; `name` itself where the pack has none like it.
std::string expression_name(const AvatarPack* pack, const char* name);
std::string eyelid_name(const AvatarPack* pack, const char* name);
std::string joint_name(const AvatarPack* pack, const char* name);

/// What a person may set or choose.
struct Names {
    std::vector<std::string> expressions, eyelids, joints, clips;
};
Names names_of(const AvatarPack* pack);

/// The clip of a name, -1: there is none.
int32_t clip_index(const AvatarPack* pack, const char* name);

}  // namespace avatar_unreal
