// The texts of the shaders. cmake/shader_texts.cmake writes the rows. AVATAR_NO_SHADER_TEXTS: the engine has its own.
#include "shader_texts.h"

#include "../../include/avatar_player.h"

namespace avatar {

const ShaderText shader_texts[] = {
#ifndef AVATAR_NO_SHADER_TEXTS
#include "avatar_shader_texts.inc"
#endif
    {0, nullptr, nullptr},
};

}  // namespace avatar
