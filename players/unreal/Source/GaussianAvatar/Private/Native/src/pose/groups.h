// Copy of players/native/src/pose/groups.h by `python -m avatar_shaders`; do not edit.
#pragma once
#include "anchors.h"

namespace avatar {

/// Part of stage joints: one rigid or mixed transform for each group of Gaussians.
class Groups {
public:
    /// Groups of an avatar, which must live as long. The arena's error is set where there is no memory.
    void make(const Avatar& avatar, Arena& arena);

    bool has_anchors() const { return !weights_.empty(); }
    /// Takes posed anchor vertices [A, 3], in the order of Skeleton::anchor_vertices, in place of computed ones.
    void set_anchors(const float* vertices);
    /// Computes matrix and rotation of skin matrices [J, 3, 4] and the posed anchors.
    void update(const double* skin);

    Span<float> matrix;    // mesh from binding mesh, [G, 3, 4]
    Span<float> rotation;  // of quaternions and of SH, [G, 3, 4] with a last column of 0
    Anchors anchors;

private:
    struct Mixed {
        int64_t joint;
        double factor;
    };

    void make_anchors(const Avatar& avatar, Arena& arena);
    void set_mix(size_t group, const double* skin, double* made) const;
    void turn(size_t group, double* made);
    void write(size_t group, const double* made, bool whole);

    const Avatar* avatar_ = nullptr;
    Span<uint32_t> order_;   // anchor i of the avatar's list -> its row in anchors
    Span<double> weights_;   // of each row in anchors
    double centre_[3] = {};
    Span<Span<Mixed>> mixes_;
    int64_t head_bone_ = -1;  // -1: none
};

}  // namespace avatar
