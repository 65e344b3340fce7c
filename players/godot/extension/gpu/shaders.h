// The kernels as SPIR-V; rows are made of the HLSL when the extension is built.
#pragma once
#include <cstddef>
#include <cstdint>

namespace godot {

struct SpirvText {
    const char* entry;
    const uint32_t* words;
    size_t count;  // of words
};

/// The SPIR-V of an entry; null: there is none.
const SpirvText* spirv_of(const char* entry);

}  // namespace godot
