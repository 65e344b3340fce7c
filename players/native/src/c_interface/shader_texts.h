#pragma once
#include <cstdint>

namespace avatar {

/// The text of an entry of the shaders in a language, AVATAR_GLSL430 and so on.
struct ShaderText {
    uint32_t language;
    const char* entry;
    const char* text;
};

/// All of them; the last row has no entry.
extern const ShaderText shader_texts[];

}  // namespace avatar
