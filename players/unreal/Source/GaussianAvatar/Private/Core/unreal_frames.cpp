#include "unreal_frames.h"

#include <cmath>

namespace avatar_unreal {
namespace {

/// Component from person: unreal = (z, -x, y). Its determinant is -1.
struct Axis {
    int row;     // Unreal's
    int column;  // the person's
    double sign;
};

constexpr Axis axes[3] = {{0, 2, 1.0}, {1, 0, -1.0}, {2, 1, 1.0}};

}  // namespace

void scene_from_avatar(const double* unreal_from_component, const double* eye, double* into) {
    const double* m = unreal_from_component;
    for (int row = 0; row < 3; ++row) {
        // Rows of an FMatrix are the images of the axes. Metres in, metres out: the centimetres cancel.
        for (const Axis& axis : axes) into[4 * row + axis.column] = axis.sign * m[4 * axis.row + row];
        into[4 * row + 3] = (m[12 + row] - eye[row]) / centimetres;
    }
    for (int column = 0; column < 4; ++column) into[12 + column] = column == 3 ? 1 : 0;
}

void person_rotation(const double* xyzw, double* into) {
    const double shorter = xyzw[3] < 0 ? -1 : 1;
    const double sine = std::sqrt(xyzw[0] * xyzw[0] + xyzw[1] * xyzw[1] + xyzw[2] * xyzw[2]);  // of half the angle
    const double angle = 2 * std::atan2(sine, std::fabs(xyzw[3]));
    // B exp([w]) B^-1 = exp(det(B) [B w]): a mirrored rotation turns the other way.
    const double factor = sine > 0 ? shorter * angle / sine : 0;
    for (const Axis& axis : axes) into[axis.column] = -factor * axis.sign * xyzw[axis.row];
}

void component_box(const double* low, const double* high, double* into_low, double* into_high) {
    for (const Axis& axis : axes) {
        const double a = centimetres * axis.sign * low[axis.column], b = centimetres * axis.sign * high[axis.column];
        into_low[axis.row] = a < b ? a : b;
        into_high[axis.row] = a < b ? b : a;
    }
}

void pack_box(const AvatarPack* pack, double* into_low, double* into_high) {
    AvatarFacts facts = {};
    avatar_facts(pack, &facts);
    component_box(facts.bounds_low, facts.bounds_high, into_low, into_high);
}

bool camera_of_view(const double* view_rotation, const double* projection, int32_t width, int32_t height,
                    AvatarCamera* into) {
    const double along = projection[11];  // clip w = along * z of the view
    if (!(std::fabs(along) > 1e-6) || std::fabs(projection[15]) > 1e-6 || width < 1 || height < 1) return false;
    const double down[4] = {1, -1, 1, 1};
    for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 4; ++column) {
            const bool corner = column == 3;
            const double view = row == 3 || corner ? (row == column ? 1 : 0) : view_rotation[4 * column + row];
            into->camera_from_world[4 * row + column] = static_cast<float>(down[row] * view);
            double sum = corner ? projection[12 + row] / centimetres : 0;
            for (int k = 0; k < 3 && !corner; ++k) sum += view_rotation[4 * column + k] * projection[4 * k + row];
            // Divided by `along`, w is the depth in metres.
            into->clip_from_world[4 * row + column] = static_cast<float>(row == 1 ? -sum / along : sum / along);
        }
    }
    for (float& coordinate : into->centre) coordinate = 0;
    into->tan_half_fov[0] = static_cast<float>(std::fabs(along / projection[0]));
    into->tan_half_fov[1] = static_cast<float>(std::fabs(along / projection[5]));
    into->width = width;
    into->height = height;
    return true;
}

}  // namespace avatar_unreal
