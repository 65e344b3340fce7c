#include "poser.h"

namespace avatar {

void Poser::make(const Avatar& avatar, Arena& arena) {
    avatar_ = &avatar;
    pose_floats = arena.make<float>(static_cast<size_t>(avatar.program.pose_floats));
    if (avatar.has_skeleton) chain_.make(avatar.skeleton, arena);
    groups.make(avatar, arena);
}

static void copy_floats(float* to, Span<float> from) {
    if (from.size > 0) std::memcpy(to, from.data, from.size * sizeof(float));
}

void Poser::update(const Pose& pose, const float* anchors) {
    const PoseSections& at = avatar_->program.pose;
    copy_floats(pose_floats.data + at.weights, pose.expression_weights);
    copy_floats(pose_floats.data + at.late, pose.late_weights);
    if (!avatar_->has_skeleton) return;
    set_features(pose.joint_delta.data);
    chain_.update(pose.expression_weights.data, pose.joint_delta.data);
    float* skin = pose_floats.data + at.joints;
    for (size_t i = 0; i < chain_.skin.size; i++) skin[i] = static_cast<float>(chain_.skin[i]);
    if (groups.has_anchors()) {
        if (anchors != nullptr) groups.set_anchors(anchors);
        else groups.anchors.update(pose_floats.data, at, chain_.skin.data);
    }
    groups.update(chain_.skin.data);
}

/// Row-major R - I of the corrective joints.
void Poser::set_features(const double* delta) {
    float* to = pose_floats.data + avatar_->program.pose.features;
    for (const uint32_t joint : avatar_->skeleton.corrective_joints) {
        const double* from = delta + 16 * static_cast<size_t>(joint);
        for (int row = 0; row < 3; row++) {
            for (int column = 0; column < 3; column++) {
                *to++ = static_cast<float>(from[4 * row + column] - (row == column ? 1 : 0));
            }
        }
    }
}

}  // namespace avatar
