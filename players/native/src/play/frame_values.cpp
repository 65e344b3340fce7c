#include "frame_values.h"

#include <cmath>

#include "../pack/read.h"
#include "../pose/affine.h"

namespace avatar {

// Places in frame_sources.
static constexpr uint32_t world_rows = 0, world_quat = 3, matrix_rows = 4, rotation_rows = 7, camera_rows = 10;
static constexpr uint32_t clip_rows = 13, eye_value = 17, tan_value = 18, size_value = 19, light_values = 20;

FrameLayout::FrameLayout(size_t groups) {
    for (uint32_t i = 0; i < frame_source_count; i++) {
        first_[i] = size_;
        const bool per_group = Text(frame_sources[i].name).begins("group_");
        size_ += frame_sources[i].floats * (per_group ? groups : 1);
    }
}

size_t FrameLayout::place(Text source, uint32_t* floats) const {
    Text name;
    int64_t row = -1;
    split_source(source, &name, &row);
    uint32_t at = 0;
    while (at + 1 < frame_source_count && name != frame_sources[at].name) at++;
    *floats = frame_sources[at].floats;
    return first_[at] + (row > 0 ? *floats * static_cast<size_t>(row) : 0);
}

void FrameValues::set_row(uint32_t source, const double* row) {
    float* to = &floats[layout.first(source)];
    for (int c = 0; c < 4; c++) to[c] = static_cast<float>(row[c]);
}

/// Row after row of each [3, 4] of a table by group.
void FrameValues::set_table(uint32_t source, const float* table) {
    for (uint32_t row = 0; row < 3; row++) {
        float* to = floats.data + layout.first(source + row);
        for (size_t g = 0; g < groups; g++) std::memcpy(to + 4 * g, table + 12 * g + 4 * row, 4 * sizeof(float));
    }
}

void FrameValues::set_posed(const float* group_matrix, const float* group_rotation, const double* world_from_avatar) {
    set_world(world_from_avatar);
    set_table(matrix_rows, group_matrix);
    set_table(rotation_rows, group_rotation);
}

void FrameValues::set_world(const double* world_from_avatar) {
    for (uint32_t row = 0; row < 3; row++) set_row(world_rows + row, world_from_avatar + 4 * row);
    double quat[4];
    quat_from_matrix(quat, world_from_avatar);
    set_row(world_quat, quat);
}

/// The point whose image under the affine matrix m is `point`; false if m is singular.
static bool solve(const double* m, const float* point, double* out) {
    const double a = m[0], b = m[1], c = m[2], d = m[4], e = m[5], f = m[6], g = m[8], h = m[9], i = m[10];
    const double x = static_cast<double>(point[0]) - m[3], y = static_cast<double>(point[1]) - m[7];
    const double z = static_cast<double>(point[2]) - m[11];
    const double ei = e * i - f * h, fg = f * g - d * i, dh = d * h - e * g;
    const double determinant = a * ei + b * fg + c * dh;
    if (!(std::fabs(determinant) > 0) || std::isinf(determinant)) return false;
    out[0] = (x * ei + y * (c * h - b * i) + z * (b * f - c * e)) / determinant;
    out[1] = (x * fg + y * (a * i - c * g) + z * (c * d - a * f)) / determinant;
    out[2] = (x * dh + y * (b * g - a * h) + z * (a * e - b * d)) / determinant;
    return true;
}

void FrameValues::set_camera(const AvatarCamera& camera, const double* world) {
    double view[16], clip[16], eye[4] = {0, 0, 0, 1};
    multiply4(view, camera.camera_from_world, world);
    multiply4(clip, camera.clip_from_world, world);
    if (!solve(world, camera.centre, eye)) std::memset(view, 0, sizeof(view));
    for (uint32_t row = 0; row < 3; row++) set_row(camera_rows + row, view + 4 * row);
    for (uint32_t row = 0; row < 4; row++) set_row(clip_rows + row, clip + 4 * row);
    set_row(eye_value, eye);
    float* tangents = &floats[layout.first(tan_value)];
    float* pixels = &floats[layout.first(size_value)];
    for (int i = 0; i < 2; i++) tangents[i] = camera.tan_half_fov[i];
    pixels[0] = static_cast<float>(camera.width);
    pixels[1] = static_cast<float>(camera.height);
}

void FrameValues::set_light(const LightRows& light) {
    std::memcpy(&floats[layout.first(light_values)], &light, sizeof(light));
}

}  // namespace avatar
