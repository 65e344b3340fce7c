#include "levels.h"

#include <cmath>
#include <limits>

namespace avatar {

static constexpr double margin = 1.1;  // of a border between two levels: an avatar that stands at it does not flicker

static double determinant(const double* m) {
    return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) + m[2] * (m[4] * m[9] - m[5] * m[8]);
}

double height_px(const FramedPart& whole, const double* world, const AvatarCamera& camera) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const float* clip = camera.clip_from_world;
    double w = static_cast<double>(clip[15]), row_y = 0;
    for (int i = 0; i < 3; i++) {
        const double* row = world + 4 * i;
        const double at = row[0] * whole.target[0] + row[1] * whole.target[1] + row[2] * whole.target[2] + row[3];
        w += static_cast<double>(clip[12 + i]) * at;
        row_y += static_cast<double>(clip[4 + i]) * static_cast<double>(clip[4 + i]);
    }
    if (!(w > 0)) return infinity;
    const double scale = std::cbrt(std::fabs(determinant(world)));
    const double height = std::sqrt(row_y) * scale * whole.size[1] * camera.height / 2 / w;
    return std::isfinite(height) ? height : infinity;
}

uint32_t level_for(Span<LevelInfo> levels, double height) {
    uint32_t best = 0;
    for (uint32_t i = 1; i < levels.size; i++) {
        if (height <= levels[i].height_px) best = i;  // a level without a height compares false
    }
    return best;
}

uint32_t next_level(Span<LevelInfo> levels, double height, uint32_t level) {
    const bool stays = level_for(levels, height * margin) <= level && level <= level_for(levels, height / margin);
    return stays ? level : level_for(levels, height);
}

}  // namespace avatar
