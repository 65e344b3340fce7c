// Copy of players/native/src/pose/clip.cpp by `python -m avatar_shaders`; do not edit.
#include "clip.h"

#include <cmath>

#include "affine.h"

namespace avatar {

static constexpr double at_frame = 1e-6;  // of a frame: nearer times are that frame

void Pose::make(const Avatar& avatar, Arena& arena) {
    expression_weights = arena.make<float>(avatar.expressions.size);
    late_weights = arena.make<float>(avatar.late_morphs.size);
    joint_delta = arena.make<double>(16 * avatar.skeleton.names.size);
    world_from_avatar = arena.make<double>(16);
    if (!arena.errors().any()) reset();
}

void Pose::reset() {
    std::memset(expression_weights.data, 0, expression_weights.size * sizeof(float));
    std::memset(late_weights.data, 0, late_weights.size * sizeof(float));
    for (size_t at = 0; at < joint_delta.size; at += 16) set_identity(&joint_delta[at], 4);
    set_identity(world_from_avatar.data, 4);
}

namespace {

/// A matrix as a rotation and what remains: xx, xy, xz, yy, yz, zz; zz is negative for a mirror.
struct Split {
    double rotation[12];
    double rest[6];

    explicit Split(const float* m);
};

/// By Gram-Schmidt on the columns.
Split::Split(const float* m) {
    double a[3], b[3], c[3];
    for (int i = 0; i < 3; i++) {
        a[i] = static_cast<double>(m[4 * i]);
        b[i] = static_cast<double>(m[4 * i + 1]);
        c[i] = static_cast<double>(m[4 * i + 2]);
    }
    const double xx = std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    const double ux = a[0] / xx, uy = a[1] / xx, uz = a[2] / xx;
    const double xy = ux * b[0] + uy * b[1] + uz * b[2];
    const double dx = b[0] - xy * ux, dy = b[1] - xy * uy, dz = b[2] - xy * uz;
    const double yy = std::sqrt(dx * dx + dy * dy + dz * dz);
    const double vx = dx / yy, vy = dy / yy, vz = dz / yy;
    const double wx = uy * vz - uz * vy, wy = uz * vx - ux * vz, wz = ux * vy - uy * vx;
    const double turned[12] = {ux, vx, wx, 0, uy, vy, wy, 0, uz, vz, wz, 0};
    std::memcpy(rotation, turned, sizeof(turned));
    rest[0] = xx;
    rest[1] = xy;
    rest[2] = ux * c[0] + uy * c[1] + uz * c[2];
    rest[3] = yy;
    rest[4] = vx * c[0] + vy * c[1] + vz * c[2];
    rest[5] = wx * c[0] + wy * c[1] + wz * c[2];
}

}  // namespace

/// The rotation between both: quaternions mixed the short way, then normalised.
static void turn_between(double* out, const double* first, const double* second, double part) {
    double p[4], q[4];
    quat_from_matrix(p, first);
    quat_from_matrix(q, second);
    const double dot = p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3];
    const double keep = 1 - part, other = dot < 0 ? -part : part;
    double mixed[4], square = 0;
    for (int i = 0; i < 4; i++) {
        mixed[i] = keep * p[i] + other * q[i];
        square += mixed[i] * mixed[i];
    }
    const double scale = 1 / std::sqrt(square);
    set_from_quat(out, mixed[0] * scale, mixed[1] * scale, mixed[2] * scale, mixed[3] * scale);
}

/// Writes 1 - part of affine matrix a [4, 4] and `part` of b. Equal matrices, and a part of 0, give a's numbers.
static void mix_matrices(double* out, const float* a, const float* b, double part) {
    for (int k = 0; k < 16; k++) out[k] = static_cast<double>(a[k]);
    bool same = true;
    for (int k = 0; k < 12 && part != 0; k++) same = same && a[k] == b[k];
    if (same) return;
    const Split first(a), second(b);
    double turned[12] = {}, rest[6];
    turn_between(turned, first.rotation, second.rotation, part);
    const double keep = 1 - part;
    for (int k = 0; k < 6; k++) rest[k] = keep * first.rest[k] + part * second.rest[k];
    for (int row = 0; row < 12; row += 4) {
        const double x = turned[row], y = turned[row + 1], z = turned[row + 2];
        out[row] = x * rest[0];
        out[row + 1] = x * rest[1] + y * rest[3];
        out[row + 2] = x * rest[2] + y * rest[4] + z * rest[5];
        out[row + 3] = keep * static_cast<double>(a[row + 3]) + part * static_cast<double>(b[row + 3]);
    }
}

static void mix_weights(Span<float> out, const float* rows, size_t first, size_t second, double part) {
    const float *a = rows + first * out.size, *b = rows + second * out.size;
    for (size_t i = 0; i < out.size; i++) {
        out[i] = static_cast<float>((1 - part) * static_cast<double>(a[i]) + part * static_cast<double>(b[i]));
    }
}

void sample_clip(const ClipData& clip, double seconds, Pose& pose) {
    double place = std::fmin(std::fmax(seconds * clip.fps, 0), clip.frames - 1);  // NaN becomes 0
    const double nearest = std::floor(place + 0.5);
    const bool exact = std::fabs(place - nearest) < at_frame;
    const size_t first = static_cast<size_t>(exact ? nearest : std::floor(place)), second = exact ? first : first + 1;
    const double part = exact ? 0 : place - static_cast<double>(first);
    mix_weights(pose.expression_weights, clip.expression_weights.data, first, second, part);
    mix_weights(pose.late_weights, clip.late_weights.data, first, second, part);
    const size_t joints = pose.joint_delta.size;
    for (size_t at = 0; at < joints; at += 16) {
        const float* rows = clip.joint_delta.data + at;
        mix_matrices(&pose.joint_delta[at], rows + first * joints, rows + second * joints, part);
    }
    const float* world = clip.world_from_avatar.data;
    mix_matrices(pose.world_from_avatar.data, world + 16 * first, world + 16 * second, part);
}

}  // namespace avatar
