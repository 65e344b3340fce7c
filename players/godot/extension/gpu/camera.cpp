#include "camera.h"

namespace godot {

static constexpr double heights_away = 4096;  // of the image: sizes and places are true to a part in so many

/// camera from world: the inverse of a turn and a place.
static void write_view(const Transform3D& stands, double* view) {
    const float* const origin = &stands.origin.x;
    for (int r = 0; r < 3; r++) {
        double moved = 0;
        for (int c = 0; c < 3; c++) {
            view[4 * r + c] = static_cast<double>(stands.rows[c][r]);
            moved -= static_cast<double>(stands.rows[c][r]) * static_cast<double>(origin[c]);
        }
        view[4 * r + 3] = moved;
    }
    for (int c = 0; c < 4; c++) view[12 + c] = c == 3;
}

/// Moves the camera far back, and makes the lens narrower by as much. `depth` is exact at the distance of `middle`.
static void give_perspective(const double* middle, double* view, double* lens, double* depth) {
    const double away = heights_away * 2 / lens[5];  // of what has its true size
    const double slope = depth[2], at_camera = depth[3];
    double ahead = -view[11];
    for (int c = 0; c < 3; c++) ahead -= view[8 + c] * middle[c];
    view[11] -= away - ahead;
    for (int r = 0; r < 8; r += 4) {
        lens[r + 2] = -lens[r + 3];
        for (int c = 0; c < 2; c++) lens[r + c] *= away;
    }
    lens[14] = -1;
    lens[15] = 0;
    // depth * w, which is a square of the distance, by its tangent
    depth[2] = 2 * slope * away - slope * (away - ahead) - at_camera;
    depth[3] = slope * away * away;
}

const char* camera_of(const Transform3D& stands, const Projection& projection, const double* middle, Vector2i size,
                      AvatarCamera& out) {
    double view[16], lens[16];
    write_view(stands, view);
    for (int r = 0; r < 4; r++) {
        for (int c = 0; c < 4; c++) lens[4 * r + c] = static_cast<double>(projection.columns[c][r]);
    }
    // Corrected: y points down, and depth falls from 1 at the near plane to 0. OpenGL's: depth rises from -1 to 1.
    const bool corrected = lens[10] >= 0, points_down = lens[5] < 0;
    double depth[4];
    for (int c = 0; c < 4; c++) {
        depth[c] = corrected ? lens[8 + c] : 0.5 * (lens[12 + c] - lens[8 + c]);
        if (points_down) lens[4 + c] = -lens[4 + c];
    }
    if (lens[15] != 0) give_perspective(middle, view, lens, depth);
    if (const char* line = avatar_camera_opengl(&out, view, lens, size.x, size.y)) return line;
    for (int c = 0; c < 4; c++) {  // the depth that the engine's own triangles have
        double sum = 0;
        for (int k = 0; k < 4; k++) sum += depth[k] * view[4 * k + c];
        out.clip_from_world[8 + c] = static_cast<float>(sum);
    }
    return nullptr;
}

}  // namespace godot
