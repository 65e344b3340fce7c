#include "groups.h"

#include <algorithm>

#include "../made/constants.h"
#include "affine.h"
#include "fit.h"

namespace avatar {

void Groups::make(const Avatar& avatar, Arena& arena) {
    avatar_ = &avatar;
    const size_t count = avatar.groups.size;
    matrix = arena.make<float>(12 * count);
    rotation = arena.make<float>(12 * count);
    mixes_ = arena.make<Span<Mixed>>(count);
    for (size_t g = 0; g < count && !arena.errors().any(); g++) {
        for (size_t k = 0; k < 12; k += 5) matrix[12 * g + k] = rotation[12 * g + k] = 1;
        const Span<Factor> factors = avatar.groups[g].joint_mix;
        mixes_[g] = arena.make<Mixed>(factors.size);
        for (size_t i = 0; i < mixes_[g].size; i++) {
            mixes_[g][i] = {avatar.joint_names.find(factors[i].joint), factors[i].factor};
        }
    }
    if (avatar.rules.rotation == "head_bone") head_bone_ = avatar.joint_names.find(avatar.rules.rotation_joint);
    make_anchors(avatar, arena);
}

/// Sorts and drops repeats.
static Span<uint32_t> sorted(Span<uint32_t> listed, Arena& arena) {
    Span<uint32_t> unique = arena.copy(listed.data, listed.size);
    std::sort(unique.begin(), unique.end());
    unique.size = static_cast<size_t>(std::unique(unique.begin(), unique.end()) - unique.begin());
    return unique;
}

static uint32_t place_in(Span<uint32_t> rising, uint32_t value) {
    size_t low = 0, high = rising.size;
    while (high - low > 1) {
        const size_t middle = (low + high) / 2;
        (rising[middle] <= value ? low : high) = middle;
    }
    return static_cast<uint32_t>(low);
}

void Groups::make_anchors(const Avatar& avatar, Arena& arena) {
    bool needed = false;
    for (const Group& one : avatar.groups) needed |= one.binding == Binding::anchor;
    const Span<uint32_t> listed = avatar.skeleton.anchor_vertices;
    if (!needed || !avatar.has_skeleton || listed.empty()) return;
    const Span<uint32_t> unique = sorted(listed, arena);
    order_ = arena.make<uint32_t>(listed.size);
    weights_ = arena.make<double>(unique.size);
    if (arena.errors().any()) return;
    anchors.make(avatar.program, unique, arena);
    if (arena.errors().any()) return;
    const bool once = avatar.rules.anchor == "unique";
    for (size_t i = 0; i < listed.size; i++) {
        order_[i] = place_in(unique, listed[i]);
        weights_[order_[i]] = once ? 1 : weights_[order_[i]] + 1;
    }
    set_mean(centre_, anchors.rest, weights_);
}

void Groups::set_anchors(const float* vertices) {
    for (size_t i = 0; i < order_.size; i++) {
        for (size_t c = 0; c < 3; c++) anchors.posed[3 * order_[i] + c] = static_cast<double>(vertices[3 * i + c]);
    }
}

void Groups::update(const double* skin) {
    double made[12], fit[12];
    bool has_fit = false;
    for (size_t g = 0; g < avatar_->groups.size; g++) {
        const Binding binding = avatar_->groups[g].binding;
        if (binding == Binding::anchor && has_anchors()) {
            if (!has_fit) set_rigid_fit(fit, anchors.rest, anchors.posed, weights_, centre_);
            has_fit = true;
            write(g, fit, true);
        } else if (binding == Binding::joint_mix) {
            set_mix(g, skin, made);
            write(g, made, true);
            turn(g, made);
        } else if (binding == Binding::skin && head_bone_ >= 0) {
            std::memcpy(made, skin + 12 * head_bone_, sizeof(made));
            turn(g, made);
        }
    }
}

/// A mix of joints: M = sum_j c_j A_j + (1 - sum_j c_j) I.
void Groups::set_mix(size_t group, const double* skin, double* made) const {
    double rest = 1;
    double total = 0;
    for (const Mixed& one : mixes_[group]) total += one.factor;
    rest -= total;
    for (int k = 0; k < 12; k++) {
        made[k] = k % 5 == 0 ? rest : 0;
        for (const Mixed& one : mixes_[group]) made[k] += one.factor * skin[12 * one.joint + k];
    }
}

/// The group's rotation is that of what is made.
void Groups::turn(size_t group, double* made) {
    make_polar(made, polar_steps);
    write(group, made, false);
}

/// Copies what is made to the group's rotation, and with `whole` to its matrix too.
void Groups::write(size_t group, const double* made, bool whole) {
    for (size_t k = 0, at = 12 * group; k < 12; k++, at++) {
        rotation[at] = k % 4 == 3 ? 0 : static_cast<float>(made[k]);
        if (whole) matrix[at] = static_cast<float>(made[k]);
    }
}

}  // namespace avatar
