// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.
#pragma once
#include <cstdint>

namespace avatar {

/// Of the kernels. A pack of newer ones is refused.
constexpr uint32_t shader_version = 1;

/// Newton steps R <- (R + R^-T) / 2 of the polar factor; 1e-14 away at 30 degrees, 1e-9 at 60.
constexpr uint32_t polar_steps = 3;

/// Threads of a group.
constexpr uint32_t threads = 64;

/// Values of a digit.
constexpr uint32_t sort_digits = 16;

/// Pairs of a thread.
constexpr uint32_t sort_items = 16;

/// Pairs of a block, which a group sorts.
constexpr uint32_t sort_block = threads * sort_items;

}  // namespace avatar
