// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.
#pragma once
#include <cstdint>

namespace avatar {

/// Of the kernels. A pack of newer ones is refused.
constexpr uint32_t shader_version = 1;

/// Newton steps R <- (R + R^-T) / 2 of the polar factor; 1e-14 away at 30 degrees, 1e-9 at 60.
constexpr uint32_t polar_steps = 3;

/// Real spherical harmonics, band 0.
constexpr double sh_c0[] = {0.28209479177387814};

/// Band 1 with its signs, factors of y, z, x.
constexpr double sh_c1[] = {-0.4886025119029199, 0.4886025119029199, -0.4886025119029199};

/// Band 2, factors of xy, yz, 2zz-xx-yy, xz, xx-yy.
constexpr double sh_c2[] = {1.0925484305920792, -1.0925484305920792, 0.31539156525252005, -1.0925484305920792, 0.5462742152960396};

/// Texels along an edge of a shadow map.
constexpr uint32_t shadow_size = 256;

/// Threads of a group.
constexpr uint32_t threads = 64;

/// Values of a digit.
constexpr uint32_t sort_digits = 16;

/// Pairs of a thread.
constexpr uint32_t sort_items = 16;

/// Pairs of a block, which a group sorts.
constexpr uint32_t sort_block = threads * sort_items;

}  // namespace avatar
