// Copy of players/native/src/made/shader_texts.h by `python -m avatar_shaders`; do not edit.
#pragma once
#include <cstdint>

namespace avatar {

/// The text of an entry of the shaders.
struct ShaderText {
    const char* entry;
    const char* text;
};

extern const ShaderText glsl430_texts[];
extern const uint32_t glsl430_text_count;
extern const ShaderText glsl310es_texts[];
extern const uint32_t glsl310es_text_count;
extern const ShaderText msl_texts[];
extern const uint32_t msl_text_count;

}  // namespace avatar
