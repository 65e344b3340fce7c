#include "planes.h"

namespace avatar {

static const PlanePlace splat_places[] = {
    {"mean", 0, 0, 3, 3},      {"opacity_logit", 0, 3, 1, 1}, {"opacity", 0, 3, 1, 1},     {"quat_wxyz", 1, 0, 4, 4},
    {"log_scale", 2, 3, 3, 1}, {"scale", 2, 3, 3, 1},         {"sh_rotation", 2, 0, 9, 3},
};
static const PlanePlace projected_places[] = {
    {"centre", 0, 0, 2, 2}, {"depth", 0, 2, 1, 1}, {"opacity", 0, 3, 1, 1},
    {"conic", 1, 0, 3, 3},  {"radius", 1, 3, 1, 1}, {"rgb", 2, 0, 3, 3},
};

const PlanePlace* place_of(Text name, bool projected) {
    if (projected) {
        for (const PlanePlace& one : projected_places) {
            if (name == one.name) return &one;
        }
        return nullptr;
    }
    for (const PlanePlace& one : splat_places) {
        if (name == one.name) return &one;
    }
    return nullptr;
}

static size_t index_in(const PlanePlace& place, size_t row, size_t k, size_t rows) {
    return 4 * ((place.plane + k / place.a_plane) * rows + row) + place.first + k % place.a_plane;
}

void put_plane(float* planes, const PlanePlace& place, const double* values, Run chunk) {
    const size_t first = static_cast<size_t>(chunk.first), rows = static_cast<size_t>(chunk.count);
    for (size_t i = 0; i < rows * place.components; i++) {
        const size_t row = i / place.components, k = i % place.components;
        planes[index_in(place, row, k, rows)] = static_cast<float>(values[first * place.components + i]);
    }
}

void take_plane(const float* planes, const PlanePlace& place, double* into, Run chunk) {
    const size_t first = static_cast<size_t>(chunk.first), rows = static_cast<size_t>(chunk.count);
    for (size_t i = 0; i < rows * place.components; i++) {
        const size_t row = i / place.components, k = i % place.components;
        into[first * place.components + i] = static_cast<double>(planes[index_in(place, row, k, rows)]);
    }
}

}  // namespace avatar
