#pragma once
#include <cstdint>

namespace avatar {

/// As raster_vertex and raster_vertex_fetch have it.
struct RasterBlock {
    float image_size[2];
    float flip_y, unused;
};

/// As composite_pixel has it.
struct CompositeBlock {
    float background[4];
    float linear_target, flip_rows;
    float image_size[2];
};

/// The number of every uniform block in GLSL and SPIR-V.
constexpr uint32_t constants_binding = 8;

}  // namespace avatar
