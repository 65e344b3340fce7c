// Copy of players/native/src/conform/planes.h by `python -m avatar_shaders`; do not edit.
#pragma once
#include "../pack/model.h"

namespace avatar {

/// Where an array of a stage lies in the planes of a buffer: four floats a row and plane.
struct PlanePlace {
    const char* name;
    size_t plane;
    size_t first;  // of the four floats
    size_t components;
    size_t a_plane;  // components that lie in one plane; the next ones lie in the next
};

constexpr size_t splat_planes = 5, projected_planes = 3;

/// The place of an array in the planes of Splats or Projected; null: it has none.
const PlanePlace* place_of(Text name, bool projected);

/// Writes the rows of a chunk of an array into planes.
void put_plane(float* planes, const PlanePlace& place, const double* values, Run chunk);

/// Reads an array of planes into the rows of a chunk.
void take_plane(const float* planes, const PlanePlace& place, double* into, Run chunk);

}  // namespace avatar
