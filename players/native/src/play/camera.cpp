// The cameras of avatar_player.h: float32 matrices for passes, computed in float64.
#include "camera.h"

#include <cmath>

#include "../formats/finite.h"
#include "../formats/sized.h"
#include "../pose/affine.h"

namespace avatar {

static constexpr double near_plane = 0.01;  // of the projection alone; each avatar decides from which depth it is drawn
static constexpr double far_plane = 100;
static constexpr double depth_scale = far_plane / (far_plane - near_plane);
static constexpr int32_t widest = 1 << 15;  // pixels
static constexpr double rotation_tolerance = 1e-3;  // of any entry of R R^T - I
static const char* const not_given = "the camera: an argument is NULL";
static const char* const no_size = "the camera: struct_size must be sizeof(AvatarCamera)";
static const char* const not_finite = "the camera: a number is not finite, or beyond float32";
static const char* const no_pixels = "the camera: width and height must be 1 to 32768 pixels";

static bool has_pixels(int32_t width, int32_t height) {
    return width >= 1 && height >= 1 && width <= widest && height <= widest;
}

static bool is_rotation(const double* r) {
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            double dot = i == j ? -1 : 0;
            for (int k = 0; k < 3; k++) dot += r[3 * i + k] * r[3 * j + k];
            if (std::fabs(dot) > rotation_tolerance) return false;
        }
    }
    const double determinant = r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
                               r[2] * (r[3] * r[7] - r[4] * r[6]);
    return determinant > 0;
}

static const char* wrong_with(const AvatarCamera& camera) {
    if (!has_pixels(camera.width, camera.height)) return no_pixels;
    const bool finite = all_finite(camera.camera_from_world, 16) && all_finite(camera.clip_from_world, 16) &&
                        all_finite(camera.centre, 3) && all_finite(camera.tan_half_fov, 2);
    if (!finite) return not_finite;
    if (camera.tan_half_fov[0] > 0 && camera.tan_half_fov[1] > 0) return nullptr;
    return "the camera: its field of view is empty or turned over; tan_half_fov must be above 0";
}

const char* take_camera(const AvatarCamera* given, AvatarCamera& into) {
    if (given == nullptr) return not_given;
    return take(given, into) ? wrong_with(into) : no_size;
}

/// Gives a camera that was made to the caller, if it can be used.
static const char* give_camera(const AvatarCamera& made, AvatarCamera* out) {
    const char* line = wrong_with(made);
    return line != nullptr ? line : give(made, out) == AVATAR_OK ? nullptr : no_size;
}

/// Writes everything that follows from a view [4, 4] and rows 0 and 1 of a projection [3, 4]; row 3 is 0 0 1 0.
static void write_camera(AvatarCamera* out, double* view, double* projection, int32_t width, int32_t height) {
    out->width = width;
    out->height = height;
    view[12] = view[13] = view[14] = 0;
    view[15] = 1;
    projection[10] = depth_scale;
    projection[11] = -depth_scale * near_plane;
    for (int i = 0; i < 16; i++) out->camera_from_world[i] = static_cast<float>(view[i]);
    for (int row = 0; row < 12; row += 4) {
        for (int column = 0; column < 4; column++) {
            double sum = 0;
            for (int k = 0; k < 4; k++) sum += projection[row + k] * view[4 * k + column];
            out->clip_from_world[row + column] = static_cast<float>(sum);
        }
    }
    for (int column = 0; column < 4; column++) out->clip_from_world[12 + column] = static_cast<float>(view[8 + column]);
    double inverse[12];
    invert_linear(inverse, view);
    for (int i = 0; i < 3; i++) {
        const double* r = inverse + 4 * i;
        out->centre[i] = static_cast<float>(-(r[0] * view[3] + r[1] * view[7] + r[2] * view[11]));
    }
}

const char* set_camera_depth(AvatarCamera* camera, const double* view, const double* projection, bool both_signs) {
    if (camera == nullptr || view == nullptr || projection == nullptr) return "the camera's depth: an argument is NULL";
    if (size_of(camera) < sizeof(AvatarCamera)) return "the camera's depth: struct_size must be sizeof(AvatarCamera)";
    const double size = std::fabs(projection[14]), z = both_signs ? 0.5 : 1, w = both_signs ? 0.5 : 0;
    double row[4];
    for (int column = 0; column < 4; column++) {
        double sum = 0;
        for (int k = 0; k < 4; k++) sum += (z * projection[8 + k] + w * projection[12 + k]) * view[4 * k + column];
        row[column] = sum / size;
    }
    if (!all_finite(row, 4)) return "the camera's depth: view and projection must be finite, with a perspective";
    for (int column = 0; column < 4; column++) camera->clip_from_world[8 + column] = static_cast<float>(row[column]);
    return nullptr;
}

}  // namespace avatar

using namespace avatar;

const char* avatar_camera_orbit(AvatarCamera* camera, const double* target, double distance, double yaw, double pitch,
                                double fov_y, int32_t width, int32_t height) {
    if (camera == nullptr || target == nullptr) return not_given;
    if (!all_finite(target, 3) || !all_finite(&distance, 1) || !all_finite(&yaw, 1) || !all_finite(&pitch, 1)) return not_finite;
    if (!(fov_y > 0 && fov_y < 3.14159265358979323846)) return "the camera: fov_y must be more than 0 and less than pi, radians";
    const double sy = std::sin(yaw), cy = std::cos(yaw), sp = std::sin(pitch), cp = std::cos(pitch);
    const double r[] = {cy, 0, -sy, sp * sy, -cp, sp * cy, -sy * cp, -sp, -cy * cp};  // right, down, forward
    const double eye[] = {target[0] + distance * sy * cp, target[1] + distance * sp, target[2] + distance * cy * cp};
    double translation[3];
    for (int i = 0; i < 3; i++) {
        translation[i] = -(r[3 * i] * eye[0] + r[3 * i + 1] * eye[1] + r[3 * i + 2] * eye[2]);
    }
    const double focal = height / (2 * std::tan(fov_y / 2));
    const double intrinsics[] = {focal, 0, width / 2.0, 0, focal, height / 2.0, 0, 0, 1};
    return avatar_camera_opencv(camera, r, translation, intrinsics, width, height);
}

const char* avatar_camera_opencv(AvatarCamera* camera, const double* rotation, const double* translation,
                                 const double* intrinsics, int32_t width, int32_t height) {
    if (camera == nullptr || rotation == nullptr || translation == nullptr || intrinsics == nullptr) return not_given;
    if (!has_pixels(width, height)) return no_pixels;
    if (!all_finite(rotation, 9) || !all_finite(translation, 3) || !all_finite(intrinsics, 9)) return not_finite;
    if (!is_rotation(rotation)) return "the camera: rotation must be a rotation matrix of determinant 1";
    const double* k = intrinsics;
    if (!(k[0] > 0 && k[4] > 0) || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
        return "the camera: intrinsics must be fx, skew, cx; 0, fy, cy; 0, 0, 1, with fx and fy above 0";
    }
    AvatarCamera made = {};
    double view[16], projection[12] = {};
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) view[4 * i + j] = rotation[3 * i + j];
        view[4 * i + 3] = translation[i];
    }
    projection[0] = 2 * k[0] / width;
    projection[1] = 2 * k[1] / width;
    projection[2] = 2 * k[2] / width - 1;
    projection[5] = 2 * k[4] / height;
    projection[6] = 2 * k[5] / height - 1;
    made.tan_half_fov[0] = static_cast<float>(width / (2 * k[0]));
    made.tan_half_fov[1] = static_cast<float>(height / (2 * k[4]));
    write_camera(&made, view, projection, width, height);
    return give_camera(made, camera);
}

const char* avatar_camera_opengl(AvatarCamera* camera, const double* view, const double* projection, int32_t width,
                                 int32_t height) {
    if (camera == nullptr || view == nullptr || projection == nullptr) return not_given;
    if (!has_pixels(width, height)) return no_pixels;
    if (!all_finite(view, 16) || !all_finite(projection, 16)) return not_finite;
    const double along = projection[14];  // clip w = along * z of the engine's camera
    if (!(std::fabs(along) > 1e-6) || std::fabs(projection[15]) > 1e-6) {
        return "the camera: has no perspective; an orthographic camera cannot show an avatar";
    }
    const double size = std::fabs(along), ahead = along < 0 ? -1 : 1;
    double own[16], p[12] = {};
    for (int column = 0; column < 4; column++) {
        own[column] = view[column];
        own[4 + column] = -view[4 + column];
        own[8 + column] = ahead * view[8 + column];
    }
    p[0] = projection[0] / size;
    p[1] = -projection[1] / size;
    p[2] = ahead * projection[2] / size;
    p[4] = -projection[4] / size;
    p[5] = projection[5] / size;
    p[6] = -ahead * projection[6] / size;
    if (!(p[0] > 0 && p[5] > 0)) {
        return "the camera: its projection mirrors the image or turns it over; give that of an image with y up";
    }
    AvatarCamera made = {};
    made.tan_half_fov[0] = static_cast<float>(1 / p[0]);
    made.tan_half_fov[1] = static_cast<float>(1 / p[5]);
    write_camera(&made, own, p, width, height);
    return give_camera(made, camera);
}
