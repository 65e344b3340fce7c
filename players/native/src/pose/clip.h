#pragma once
#include "../pack/model.h"

namespace avatar {

/// A pose of one avatar.
struct Pose {
    Span<float> expression_weights;  // [K]
    Span<float> late_weights;        // [L]
    Span<double> joint_delta;        // [J, 4, 4]: parent_from_joint = rest_local delta; the last rows are not read
    Span<double> world_from_avatar;  // [4, 4] rigid

    /// Room for an avatar's pose, at rest. The arena's error is set where there is no memory.
    void make(const Avatar& avatar, Arena& arena);
    /// Back to rest: weights 0, joints and the whole avatar unmoved.
    void reset();
};

/// Writes the pose of a clip at a time; times beyond the ends are those of the ends. Frames are exact. Between two
/// frames weights are linear. A matrix is split into a rotation and what remains (Gram-Schmidt: scale and shear);
/// quaternions are mixed and normalised, the remainder and the translation are linear.
void sample_clip(const ClipData& clip, double seconds, Pose& pose);

}  // namespace avatar
