// Copy of players/native/src/pose/chain.cpp by `python -m avatar_shaders`; do not edit.
#include "chain.h"

#include "affine.h"

namespace avatar {

/// [J, 4, 4] without its last rows.
static Span<double> rows_of(Span<double> matrices, Arena& arena) {
    Span<double> found = arena.make<double>(matrices.size / 16 * 12);
    for (size_t joint = 0; 12 * joint < found.size; joint++) {
        std::memcpy(&found[12 * joint], &matrices[16 * joint], 12 * sizeof(double));
    }
    return found;
}

Span<double> rest_linear(const Skeleton& skeleton, Arena& arena) {
    Span<double> rest = rows_of(skeleton.rest_local, arena);
    for (size_t at = 0; at < rest.size; at += 12) {
        rest[at + 3] = rest[at + 7] = rest[at + 11] = 0;
        const int32_t parent = skeleton.parents[at / 12];
        if (parent >= 0) multiply_linear(&rest[at], &rest[12 * static_cast<size_t>(parent)], &rest[at]);
    }
    return rest;
}

/// Expressions that move a joint.
static Span<uint32_t> moving_expressions(Span<double> basis, size_t floats, Arena& arena) {
    const size_t expressions = floats == 0 ? 0 : basis.size / floats;
    Span<uint32_t> found = arena.make<uint32_t>(expressions);
    size_t count = 0;
    for (size_t k = 0; k < expressions && !found.empty(); k++) {
        bool moves = false;
        for (size_t at = k * floats; at < (k + 1) * floats; at++) moves |= basis[at] != 0;
        if (moves) found[count++] = static_cast<uint32_t>(k);
    }
    found.size = count;
    return found;
}

void Chain::make(const Skeleton& skeleton, Arena& arena) {
    const size_t joints = skeleton.names.size;
    skeleton_ = &skeleton;
    skin = arena.make<double>(12 * joints);
    local_ = rows_of(skeleton.rest_local, arena);
    inverse_bind_ = rows_of(skeleton.inverse_bind, arena);
    from_mesh_ = arena.make<double>(12 * joints);
    moved_ = arena.make<double>(3 * joints);
    posed_ = arena.make<double>(12 * joints);
    moving_ = moving_expressions(skeleton.joint_basis, 3 * joints, arena);
    const Span<double> rest = rest_linear(skeleton, arena);
    if (arena.errors().any()) return;
    for (size_t at = 0; at < from_mesh_.size; at += 12) {
        const int32_t parent = skeleton.parents[at / 12];
        if (parent < 0) from_mesh_[at] = from_mesh_[at + 5] = from_mesh_[at + 10] = 1;
        else invert_linear(&from_mesh_[at], &rest[12 * static_cast<size_t>(parent)]);
    }
}

void Chain::update(const float* weights, const double* delta) {
    set_rest(weights);
    double step[12];
    for (size_t joint = 0; joint < skeleton_->parents.size; joint++) {
        set_rest_step(joint, step);
        multiply(step, step, delta + 16 * joint);
        place(joint, step);
    }
}

/// How the weights [K] move the rest joints.
void Chain::set_rest(const float* weights) {
    if (moving_.empty()) return;
    std::memset(moved_.data, 0, moved_.size * sizeof(double));
    for (const uint32_t k : moving_) {
        const double weight = static_cast<double>(weights[k]);
        if (weight == 0) continue;
        const double* basis = &skeleton_->joint_basis[k * moved_.size];
        for (size_t c = 0; c < moved_.size; c++) moved_[c] += weight * basis[c];
    }
}

/// Writes B'_parent^-1 B'_joint [3, 4] with B'_j = T(d_j) B_j. Its linear part is that of rest_local; its translation
/// gains (d_joint - d_parent) in the parent's frame. Of a root it is B'_joint.
void Chain::set_rest_step(size_t joint, double* into) const {
    const int32_t parent = skeleton_->parents[joint];
    const size_t at = 12 * joint;
    std::memcpy(into, &local_[at], 12 * sizeof(double));
    if (moving_.empty()) return;
    double d[3];
    for (size_t c = 0; c < 3; c++) {
        d[c] = moved_[3 * joint + c] - (parent < 0 ? 0 : moved_[3 * static_cast<size_t>(parent) + c]);
    }
    for (size_t row = 0; row < 12; row += 4) {
        const double* m = &from_mesh_[at + row];
        into[row + 3] += m[0] * d[0] + m[1] * d[1] + m[2] * d[2];
    }
}

/// Sets a joint whose transform in its parent's space is given; its parent is set.
void Chain::place(size_t joint, const double* parent_from_joint) {
    const int32_t parent = skeleton_->parents[joint];
    const size_t at = 12 * joint;
    if (parent >= 0) multiply(&posed_[at], &posed_[12 * static_cast<size_t>(parent)], parent_from_joint);
    else std::memcpy(&posed_[at], parent_from_joint, 12 * sizeof(double));
    multiply(&skin[at], &posed_[at], &inverse_bind_[at]);
    if (moving_.empty()) return;
    const double* d = &moved_[3 * joint];
    for (size_t i = at; i < at + 12; i += 4) skin[i + 3] -= skin[i] * d[0] + skin[i + 1] * d[1] + skin[i + 2] * d[2];
}

}  // namespace avatar
