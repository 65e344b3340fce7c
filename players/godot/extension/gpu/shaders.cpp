#include "shaders.h"

#include <cstring>

namespace godot {

namespace {
#include "avatar_spirv.inc"
}  // namespace

const SpirvText* spirv_of(const char* entry) {
    for (const SpirvText& one : spirv_texts) {
        if (std::strcmp(one.entry, entry) == 0) return &one;
    }
    return nullptr;
}

}  // namespace godot
