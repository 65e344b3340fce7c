// Copy of players/native/src/conform/cpu_stages.cpp by `python -m avatar_shaders`; do not edit.
// Stages driving and joints, which no GPU runs.
#include "../drive/driver.h"
#include "../drive/recording.h"
#include "../pose/poser.h"
#include "reference.h"

namespace avatar {

template <class T>
static Span<double> doubles(Span<T> values, Arena& arena) {
    Span<double> made = arena.make<double>(values.size);
    for (size_t i = 0; i < made.size; i++) made[i] = static_cast<double>(values[i]);
    return made;
}

/// An input of exactly this size; null where there is none, or another.
static const double* input(const Step& step, const char* name, size_t size) {
    const Named* found = step.inputs.find(name);
    return found != nullptr && found->values.size == size ? found->values.data : nullptr;
}

static bool fill(Span<float> into, const double* values) {
    for (size_t i = 0; i < into.size && values != nullptr; i++) into[i] = static_cast<float>(values[i]);
    return values != nullptr;
}

bool run_driving(const Avatar& avatar, const Step& step, bool within_range, Arena& arena, Arrays& out) {
    const double* channels = input(step, "channels", arkit_channels);
    Driver driver;
    Pose pose;
    driver.make(avatar, within_range, arena);
    pose.make(avatar, arena);
    if (channels == nullptr || arena.errors().any()) return channels != nullptr;
    AvatarFrame frame;
    set_channels(frame, channels);
    driver.pose(frame, pose);
    out.add("expression_weights", doubles(pose.expression_weights, arena));
    out.add("late_weights", doubles(pose.late_weights, arena));
    out.add("joint_delta", pose.joint_delta);
    out.add("world_from_avatar", pose.world_from_avatar);
    return true;
}

/// Stage joints poses the anchor vertices itself, so it needs the late weights that stage skin is given.
static const Named* late_weights(const Case& of) {
    for (const Step& step : of.steps) {
        const Named* late = step.inputs.find("late_weights");
        if (late != nullptr) return late;
    }
    return nullptr;
}

static void add_outputs(const Avatar& avatar, const Poser& poser, Arena& arena, Arrays& out) {
    const PoseSections& at = avatar.program.pose;
    const size_t joints = avatar.skeleton.names.size;
    Span<double> skin = arena.make<double>(16 * joints);
    Span<double> rotation = arena.make<double>(9 * avatar.groups.size);
    if (arena.errors().any()) return;
    for (size_t i = 0; i < skin.size; i++) {
        const size_t place = static_cast<size_t>(at.joints) + i / 16 * 12 + i % 16;
        skin[i] = i % 16 < 12 ? static_cast<double>(poser.pose_floats[place]) : i % 16 == 15 ? 1 : 0;
    }
    for (size_t i = 0; i < rotation.size; i++) rotation[i] = static_cast<double>(poser.groups.rotation[i / 3 * 4 + i % 3]);
    const Span<float> features = {poser.pose_floats.data + at.features, static_cast<size_t>(at.late - at.features)};
    out.add("skin_matrix", skin);
    out.add("pose_feature", doubles(features, arena));
    out.add("group_matrix", doubles(poser.groups.matrix, arena));
    out.add("group_rotation", rotation);
}

bool run_joints(const Avatar& avatar, const Case& of, const Step& step, Arena& arena, Arrays& out) {
    Pose pose;
    Poser poser;
    pose.make(avatar, arena);
    poser.make(avatar, arena);
    Span<float> anchors = arena.make<float>(3 * avatar.skeleton.anchor_vertices.size);
    if (arena.errors().any()) return true;
    const double* delta = input(step, "joint_delta", pose.joint_delta.size);
    if (delta == nullptr) return false;
    if (!fill(pose.expression_weights, input(step, "expression_weights", pose.expression_weights.size))) return false;
    std::memcpy(pose.joint_delta.data, delta, pose.joint_delta.size * sizeof(double));
    const Named* late = late_weights(of);
    bool has_anchors = false;
    if (late != nullptr) {
        if (late->values.size != pose.late_weights.size || !fill(pose.late_weights, late->values.data)) return false;
    } else if (step.inputs.find("anchor_vertices") != nullptr) {
        has_anchors = true;
        if (!fill(anchors, input(step, "anchor_vertices", anchors.size))) return false;
    }
    poser.update(pose, has_anchors ? anchors.data : nullptr);
    add_outputs(avatar, poser, arena, out);
    return true;
}

}  // namespace avatar
