#include "unreal_levels.h"

#include <limits>

namespace avatar_unreal {
namespace {

constexpr double margin = 1.1;  // of a border between two levels

/// Row `row` of a product [4, 4] times a point.
double along(const float* matrix, int row, const double (&point)[3]) {
    const float* r = matrix + 4 * row;
    return r[0] * point[0] + r[1] * point[1] + r[2] * point[2] + r[3];
}

}  // namespace

double height_px(const double* low, const double* high, const double* scene_from_avatar, const AvatarCamera& camera) {
    const double infinity = std::numeric_limits<double>::infinity();
    double top = infinity, bottom = -infinity;
    int before = 0;
    for (int corner = 0; corner < 8; ++corner) {
        double point[3];
        for (int row = 0; row < 3; ++row) {
            const double* m = scene_from_avatar + 4 * row;
            point[row] = m[3];
            for (int i = 0; i < 3; ++i) point[row] += m[i] * ((corner >> i & 1) != 0 ? high[i] : low[i]);
        }
        const double depth = along(camera.clip_from_world, 3, point);
        if (!(depth > 0)) continue;
        ++before;
        const double y = along(camera.clip_from_world, 1, point) / depth;
        top = y < top ? y : top;
        bottom = y > bottom ? y : bottom;
    }
    if (before == 0) return 0;
    return before < 8 ? infinity : (bottom - top) / 2 * camera.height;
}

uint32_t level_of(const AvatarPack* pack, double height, uint32_t current) {
    const uint32_t finest = avatar_level_for(pack, height * margin);
    const uint32_t coarsest = avatar_level_for(pack, height / margin);
    return current >= finest && current <= coarsest ? current : avatar_level_for(pack, height);
}

}  // namespace avatar_unreal
