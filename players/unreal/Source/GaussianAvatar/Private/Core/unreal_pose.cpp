#include "unreal_pose.h"

#include <algorithm>

#include "unreal_face.h"
#include "unreal_frames.h"
#include "unreal_names.h"

namespace avatar_unreal {
namespace {

constexpr uint32_t matrix = 16;  // numbers of a joint
constexpr double tried = 0.5;    // a weight, and an angle in radians

template <class T>
void copy(const T* from, std::vector<T>& into, size_t count) {
    into.assign(from, from + (from == nullptr ? 0 : count));
}

void copy_joint(const double* from, std::vector<double>& into, size_t joint) {
    std::copy(from + matrix * joint, from + matrix * (joint + 1), into.data() + matrix * joint);
}

/// Sets `has` for each group of `width` values that differs.
template <class T>
void mark(const std::vector<T>& a, const std::vector<T>& b, size_t width, std::vector<char>& has) {
    for (size_t i = 0; i < a.size(); ++i) {
        if (a[i] != b[i]) has[i / width] = 1;
    }
}

}  // namespace

Pack open_pack(const void* file, size_t bytes, const char* name, std::string& error) {
    AvatarPack* opened = avatar_load(file, bytes, name, nullptr);
    const char* line = avatar_error(opened);
    if (line == nullptr) return Pack(opened, [](const AvatarPack* one) { avatar_close(const_cast<AvatarPack*>(one)); });
    error = line;
    avatar_close(opened);
    return nullptr;
}

void PoseValues::take(AvatarInstance* instance, const AvatarFacts& facts) {
    copy(avatar_expression_weights(instance), expressions, facts.expressions);
    copy(avatar_eyelid_weights(instance), eyelids, facts.eyelids);
    copy(avatar_joint_delta(instance), joint_delta, size_t{matrix} * facts.joints);
    copy(avatar_world_from_avatar(instance), world_from_avatar, matrix);
}

void PoseValues::give(AvatarInstance* instance) const {
    if (!expressions.empty()) std::copy(expressions.begin(), expressions.end(), avatar_expression_weights(instance));
    if (!eyelids.empty()) std::copy(eyelids.begin(), eyelids.end(), avatar_eyelid_weights(instance));
    if (!joint_delta.empty()) std::copy(joint_delta.begin(), joint_delta.end(), avatar_joint_delta(instance));
    std::copy(world_from_avatar.begin(), world_from_avatar.end(), avatar_world_from_avatar(instance));
}

PoseLayers::PoseLayers(Pack played) : pack(played), instance(avatar_instance_open(played.get(), 0, nullptr)) {
    avatar_facts(pack.get(), &facts);
    for (Layer& layer : layers) size(layer);
    if (avatar_instance_error(instance) != nullptr) fail();
    else mixed.take(instance, facts);
}

PoseLayers::~PoseLayers() { avatar_instance_close(instance); }

void PoseLayers::size(Layer& layer) const {
    layer.values.expressions.resize(facts.expressions);
    layer.values.eyelids.resize(facts.eyelids);
    layer.values.joint_delta.resize(size_t{matrix} * facts.joints);
    layer.has_expression.assign(facts.expressions, 0);
    layer.has_eyelid.assign(facts.eyelids, 0);
    layer.has_joint.assign(facts.joints, 0);
}

bool PoseLayers::fail() {
    const char* said = avatar_instance_error(instance);
    line = said == nullptr ? "" : said;
    return false;
}

bool PoseLayers::set_expression(Source from, const char* name, double value) {
    const std::string own = expression_name(pack.get(), name);
    if (avatar_set_expression(instance, own.c_str(), value) != AVATAR_OK) return fail();
    const auto at = static_cast<size_t>(avatar_expression_index(pack.get(), own.c_str()));
    layers[from].values.expressions[at] = static_cast<float>(value);
    layers[from].has_expression[at] = 1;
    return true;
}

bool PoseLayers::set_eyelid(Source from, const char* name, double value) {
    const std::string own = eyelid_name(pack.get(), name);
    if (avatar_set_eyelid(instance, own.c_str(), value) != AVATAR_OK) return fail();
    const auto at = static_cast<size_t>(avatar_eyelid_index(pack.get(), own.c_str()));
    layers[from].values.eyelids[at] = static_cast<float>(value);
    layers[from].has_eyelid[at] = 1;
    return true;
}

bool PoseLayers::set_joint(Source from, const char* name, const double* rotation) {
    double turned[3];
    person_rotation(rotation, turned);
    const std::string own = joint_name(pack.get(), name);
    if (avatar_set_joint(instance, own.c_str(), turned[0], turned[1], turned[2]) != AVATAR_OK) return fail();
    const auto at = static_cast<size_t>(avatar_joint_index(pack.get(), own.c_str()));
    copy_joint(avatar_joint_delta(instance), layers[from].values.joint_delta, at);
    layers[from].has_joint[at] = 1;
    return true;
}

void PoseLayers::put(const Layer& layer) {
    for (size_t i = 0; i < layer.has_expression.size(); ++i) {
        if (layer.has_expression[i] != 0) mixed.expressions[i] = layer.values.expressions[i];
    }
    for (size_t i = 0; i < layer.has_eyelid.size(); ++i) {
        if (layer.has_eyelid[i] != 0) mixed.eyelids[i] = layer.values.eyelids[i];
    }
    for (size_t j = 0; j < layer.has_joint.size(); ++j) {
        if (layer.has_joint[j] != 0) copy_joint(layer.values.joint_delta.data(), mixed.joint_delta, j);
    }
}

/// Marks what a face moves: each channel is tried alone, without limits that could hide what it does.
bool PoseLayers::learn_driven() {
    learned = true;
    size(driven);
    AvatarFrame face = {};
    if (avatar_enable_driving(instance, 0) != AVATAR_OK || avatar_drive(instance, &face) != AVATAR_OK) return fail();
    PoseValues still;
    still.take(instance, facts);
    for (uint32_t channel = 0; avatar_arkit_name(channel) != nullptr; ++channel) {
        face = {};
        set_channel(face, avatar_arkit_name(channel), tried);
        avatar_drive(instance, &face);
        driven.values.take(instance, facts);
        mark(still.expressions, driven.values.expressions, 1, driven.has_expression);
        mark(still.eyelids, driven.values.eyelids, 1, driven.has_eyelid);
        mark(still.joint_delta, driven.values.joint_delta, matrix, driven.has_joint);
        driven_root = driven_root || still.world_from_avatar != driven.values.world_from_avatar;
    }
    return avatar_enable_driving(instance, 1) == AVATAR_OK || fail();
}

bool PoseLayers::drive(const AvatarFrame& face) {
    if (!learned && !learn_driven()) driving_line = line;
    if (!driving_line.empty()) {
        line = driving_line;
        return false;
    }
    if (avatar_drive(instance, &face) != AVATAR_OK) return fail();
    driven.values.take(instance, facts);
    put(driven);
    if (driven_root) mixed.world_from_avatar = driven.values.world_from_avatar;
    return true;
}

int32_t PoseLayers::clip(const char* name, double& seconds) const {
    const int32_t index = clip_index(pack.get(), name);
    AvatarClip found = {};
    if (index >= 0) avatar_clip(pack.get(), static_cast<uint32_t>(index), &found);
    seconds = found.seconds;
    return index;
}

bool PoseLayers::mix(int32_t clip, double seconds, const AvatarFrame* face) {
    avatar_reset_pose(instance);
    const bool well = clip < 0 || avatar_clip_pose(instance, static_cast<uint32_t>(clip), seconds) == AVATAR_OK || fail();
    mixed.take(instance, facts);
    for (const Layer& layer : layers) put(layer);
    return (face == nullptr || drive(*face)) && well;
}

}  // namespace avatar_unreal
