// Copy of players/native/src/pose/poser.h by `python -m avatar_shaders`; do not edit.
#pragma once
#include "chain.h"
#include "clip.h"
#include "groups.h"

namespace avatar {

/// Stage joints of one avatar, in float64 on the CPU: everything that a GPU receives for a pose.
class Poser {
public:
    /// The stage of an avatar, which must live as long. The arena's error is set where it cannot be.
    void make(const Avatar& avatar, Arena& arena);

    /// The inputs of a frame for a pose of this avatar. `anchors` [A, 3], posed anchor vertices in the order of
    /// Skeleton::anchor_vertices, replace those of the rig; null: none. Allocates nothing.
    void update(const Pose& pose, const float* anchors = nullptr);

    Span<float> pose_floats;  // the content of buffer Pose
    Groups groups;

private:
    void set_features(const double* delta);

    const Avatar* avatar_ = nullptr;
    Chain chain_;
};

}  // namespace avatar
