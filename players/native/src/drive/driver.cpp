#include "driver.h"

#include <cmath>
#include <cstdio>

#include "../pose/affine.h"
#include "../pose/chain.h"
#include "../pose/fit.h"
#include "arkit.h"

namespace avatar {

static constexpr double most_condition = 1e6;  // of the linear part of a joint's rest transform
static const double head_signs[] = {1, -1, 1};  // of yaw, pitch, roll about +Y, +X, +Z
static const double eye_signs[] = {-1, 1, -1};
static const double mirror_signs[] = {-1, 1, -1};  // of the same angles in a left-handed frame

void Driver::make(const Avatar& avatar, bool within_range, Arena& arena) {
    avatar_ = &avatar;
    if (!avatar.has_driving) {
        arena.errors().set("driving", "ARKit weights cannot drive this avatar: no mapping from the 52 ARKit names is known");
        return;
    }
    columns_ = arena.make<int32_t>(avatar.driving.inputs.size);
    values_ = arena.make<double>(avatar.driving.outputs.size);
    for (size_t i = 0; i < columns_.size; i++) columns_[i] = shape_of(avatar.driving.inputs[i]);
    make_weights(within_range, arena);
    if (avatar.has_skeleton && !arena.errors().any()) make_joints(arena);
}

void Driver::make_weights(bool within_range, Arena& arena) {
    const Span<Text> outputs = avatar_->driving.outputs;
    weights_ = arena.make<Weight>(outputs.size);
    if (arena.errors().any()) return;
    size_t count = 0;
    for (size_t row = 0; row < outputs.size; row++) {
        const Text output = outputs[row];
        const bool late = output.begins("eyelid/");
        if (!late && !output.begins("expression/")) continue;
        const uint32_t begin = late ? 7 : 11;
        const Text name(output.data + begin, output.size - begin);
        const int64_t column = (late ? avatar_->late_names : avatar_->expression_names).find(name);
        Weight one = {row, late, static_cast<size_t>(column), -INFINITY, INFINITY};
        if (within_range) {
            one.low = late ? 0 : avatar_->expressions[one.column].low;
            one.high = late ? 1 : avatar_->expressions[one.column].high;
        }
        weights_[count++] = one;
    }
    weights_.size = count;
}

/// The ratio of the largest and the least singular value of a 3x3 part, rows four apart.
static double condition(const double* m) {
    double square[9] = {}, vectors[9];
    for (int i = 0; i < 9; i++) {
        for (int k = 0; k < 12; k += 4) square[i] += m[k + i / 3] * m[k + i % 3];
    }
    const int largest = solve_eigen(square, vectors, 3);
    const double least = std::fmin(square[0], std::fmin(square[4], square[8]));
    return std::sqrt(square[4 * largest] / std::fmax(least, 0));
}

/// Marks the rows of the matrix that turn joints: "joint/NAME/x".
static void mark_rows(Span<Text> outputs, const Names& joints, Span<int64_t> rows) {
    for (size_t row = 0; row < outputs.size; row++) {
        const Text output = outputs[row];
        if (!output.begins("joint/")) continue;
        const int64_t joint = joints.find(Text(output.data + 6, output.size - 8));
        const int64_t axis = output.data[output.size - 1] - 'x';
        rows[static_cast<size_t>(3 * joint + axis)] = static_cast<int64_t>(row);
    }
}

void Driver::make_joints(Arena& arena) {
    const Skeleton& skeleton = avatar_->skeleton;
    const Driving& driving = avatar_->driving;
    const size_t count = skeleton.names.size;
    const Span<double> rest = rest_linear(skeleton, arena);
    joints_ = arena.make<Joint>(count);
    Span<int64_t> rows = arena.make<int64_t>(3 * count);
    if (arena.errors().any()) return;
    for (int64_t& row : rows) row = -1;
    mark_rows(driving.outputs, avatar_->joint_names, rows);
    size_t turned = 0;
    for (size_t joint = 0; joint < count; joint++) {
        const Text name = skeleton.names[joint];
        Joint one = {};
        one.joint = joint;
        std::memcpy(one.rest, &rest[12 * joint], sizeof(one.rest));
        if (!(condition(one.rest) < most_condition)) {
            char field[300];
            std::snprintf(field, sizeof(field), "joint %s", Cut(name, 80).data);
            arena.errors().set(field, "has a singular rest transform, so it cannot turn");
            return;
        }
        for (size_t axis = 0; axis < 3; axis++) {
            one.rows[axis] = rows[3 * joint + axis];
            one.from_matrix |= one.rows[axis] >= 0;
        }
        one.is_head = driving.head_joint.size > 0 && name == driving.head_joint;
        one.is_left_eye = driving.left_eye_joint.size > 0 && name == driving.left_eye_joint;
        one.is_right_eye = driving.right_eye_joint.size > 0 && name == driving.right_eye_joint;
        has_head_ |= one.is_head;
        if (!one.from_matrix && !one.is_head && !one.is_left_eye && !one.is_right_eye) continue;
        invert_linear(one.inverse, one.rest);
        joints_[turned++] = one;
    }
    joints_.size = turned;
}

void Driver::pose(const AvatarFrame& frame, Pose& into) {
    into.reset();
    multiply_weights(frame.weights);
    for (const Weight& one : weights_) {
        const double weight = std::fmin(std::fmax(values_[one.row], one.low), one.high);
        (one.late ? into.late_weights : into.expression_weights)[one.column] = static_cast<float>(weight);
    }
    for (const Joint& one : joints_) turn_joint(one, frame, into);
    if (!has_head_) turn_whole(frame, into);
}

void Driver::multiply_weights(const float* given) {
    const double* matrix = avatar_->driving.matrix.data;
    for (double& value : values_) {
        value = 0;
        for (const int32_t column : columns_) {
            const double factor = *matrix++;
            value += column < 0 ? 0 : factor * static_cast<double>(given[column]);
        }
    }
}

/// The delta B^-1 R B of a joint with the rotation R that matrix, eyes and head give it.
void Driver::turn_joint(const Joint& turn, const AvatarFrame& frame, Pose& into) const {
    double rotation[12] = {}, made[12] = {};
    bool turned = turn.from_matrix;
    if (turned) {
        double angles[3];
        for (int axis = 0; axis < 3; axis++) {
            angles[axis] = turn.rows[axis] < 0 ? 0 : values_[static_cast<size_t>(turn.rows[axis])];
        }
        set_rotation(rotation, angles[0], angles[1], angles[2]);
    }
    if (turn.is_left_eye) {  // a recorder names the eyes as it sees them
        turn_eye(rotation, frame.right_eye, frame.weights, "Left", turned);
        turned = true;
    }
    if (turn.is_right_eye) {
        turn_eye(rotation, frame.left_eye, frame.weights, "Right", turned);
        turned = true;
    }
    if (turn.is_head) {
        set_euler(turned ? made : rotation, frame.head, head_signs);
        if (turned) multiply_linear(rotation, made, rotation);
    }
    multiply_linear(rotation, rotation, turn.rest);
    multiply_linear(&into.joint_delta[16 * turn.joint], turn.inverse, rotation);
}

/// Places of the eyeLook weights of an eye, by where it looks to: the subject's right, left, up and down.
static const int* look_of(const char* side) {
    static const int left[] = {shape_of("eyeLookInLeft"), shape_of("eyeLookOutLeft"), shape_of("eyeLookUpLeft"),
                               shape_of("eyeLookDownLeft")};
    static const int right[] = {shape_of("eyeLookOutRight"), shape_of("eyeLookInRight"), shape_of("eyeLookUpRight"),
                                shape_of("eyeLookDownRight")};
    return side[0] == 'L' ? left : right;
}

/// A measured eye replaces what turned it; one that nothing turned follows the weights.
void Driver::turn_eye(double* rotation, const double* measured, const float* given, const char* side, bool turned) const {
    if (measured[0] != 0 || measured[1] != 0 || measured[2] != 0) {
        set_euler(rotation, measured, eye_signs);
    } else if (!turned) {
        const int* look = look_of(side);
        const double yaw = static_cast<double>(given[look[0]]) - static_cast<double>(given[look[1]]);
        const double pitch = static_cast<double>(given[look[3]]) - static_cast<double>(given[look[2]]);
        const double angles[] = {radians_per_eye_weight * yaw, radians_per_eye_weight * pitch, 0};
        set_euler(rotation, angles, eye_signs);
    }
}

/// The whole avatar turns about the head's pivot: X = T(p) H T(-p).
void Driver::turn_whole(const AvatarFrame& frame, Pose& into) const {
    double* m = into.world_from_avatar.data;
    const double* p = avatar_->driving.head_pivot;
    set_euler(m, frame.head, head_signs);
    for (int i = 0; i < 3; i++) m[4 * i + 3] = p[i] - m[4 * i] * p[0] - m[4 * i + 1] * p[1] - m[4 * i + 2] * p[2];
}

/// Ry Rx Rz of signed angles (yaw, pitch, roll), in the frame of the avatar.
void Driver::set_euler(double* into, const double* turned, const double* signs) const {
    double half[3];
    for (int i = 0; i < 3; i++) half[i] = turned[i] * signs[i] * (avatar_->left_handed ? mirror_signs[i] : 1) / 2;
    const double ca = std::cos(half[0]), sa = std::sin(half[0]), cb = std::cos(half[1]), sb = std::sin(half[1]);
    const double cc = std::cos(half[2]), sc = std::sin(half[2]);
    set_from_quat(into, ca * cb * cc + sa * sb * sc, ca * sb * cc + sa * cb * sc, sa * cb * cc - ca * sb * sc,
                  ca * cb * sc - sa * sb * cc);
}

}  // namespace avatar
