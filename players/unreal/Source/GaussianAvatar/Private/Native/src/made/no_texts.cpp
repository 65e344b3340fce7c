// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.
#include "shader_texts.h"

namespace avatar {

const ShaderText glsl430_texts[] = {{nullptr, nullptr}};
const uint32_t glsl430_text_count = 0;
const ShaderText glsl310es_texts[] = {{nullptr, nullptr}};
const uint32_t glsl310es_text_count = 0;
const ShaderText msl_texts[] = {{nullptr, nullptr}};
const uint32_t msl_text_count = 0;

}  // namespace avatar
