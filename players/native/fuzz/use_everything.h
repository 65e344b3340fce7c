#pragma once
#include "avatar_player.h"

/// Makes and runs all that can be made of a sound pack.
void use_everything(const AvatarPack* pack, const AvatarAllocator* allocator);
