#pragma once
#include <string>

#include "avatar_light.h"

/// The light that a JSON text says, as `avatar-export render --light` reads it; `name` is what errors call it. Returns the
/// line of what is wrong, or an empty one.
std::string read_light(const std::string& text, const std::string& name, AvatarLight& into);
