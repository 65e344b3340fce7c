// Copy of players/native/src/made/constants.h by `python -m avatar_shaders`; do not edit.
// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.
#pragma once
#include <cstdint>

namespace avatar {

/// Of the kernels. A pack of newer ones is refused.
constexpr uint32_t shader_version = 1;

/// Pixels squared added to both variances of the projected covariance, so that no splat is thinner than about a pixel.
constexpr double low_pass = 0.3;

/// Floor of mid^2 - det under the square root of the larger eigenvalue; a round splat gets sqrt(0.1) more than its variance.
constexpr double eigenvalue_floor = 0.1;

/// The trainer touches the tiles of this many standard deviations; it culls tiles, never pixels.
constexpr double radius_sigmas = 3.0;

/// View z at or below this (in training units) is not drawn.
constexpr double near = 0.2;

/// X/z and y/z are clamped to this times tan(fov/2) in the Jacobian, not in the centre.
constexpr double frustum_clamp = 1.3;

/// Added to clip w before its reciprocal.
constexpr double homogeneous_epsilon = 1e-07;

/// Alpha of one splat at one pixel never exceeds this.
constexpr double alpha_max = 0.99;

/// Alpha below 1 / this is skipped (the division is done in float32).
constexpr double alpha_min_denominator = 255.0;

/// The splat that would bring the transmittance below this is not added and ends the pixel (trainer profile).
constexpr double transmittance_min = 0.0001;

/// Pixels along the side of a tile.
constexpr uint32_t tile = 16;

/// Newton steps R <- (R + R^-T) / 2 of the polar factor; 1e-14 away at 30 degrees, 1e-9 at 60.
constexpr uint32_t polar_steps = 3;

/// Least length, an area in training units squared, by which a summed vertex normal is divided.
constexpr double normal_floor = 1e-06;

/// Least length, an area in training units squared, by which a summed vertex quaternion is divided.
constexpr double quaternion_floor = 1e-06;

/// Training units squared, added to both areas of the ratio that scales a Gaussian; it dominates on meshes in metres.
constexpr double area_damping = 0.0001;

/// Threads of a group.
constexpr uint32_t threads = 64;

/// Values of a digit.
constexpr uint32_t sort_digits = 16;

/// Pairs of a thread.
constexpr uint32_t sort_items = 16;

/// Pairs of a block, which a group sorts.
constexpr uint32_t sort_block = threads * sort_items;

/// Threads of the one group of sort_scan.
constexpr uint32_t sort_scan_threads = 128;

/// Splats an instance of raster_vertex_batch.
constexpr uint32_t quad_batch = 128;

/// Splats a row of the texture that raster_vertex_batch reads: three texels each.
constexpr uint32_t quad_row = 512;

}  // namespace avatar
