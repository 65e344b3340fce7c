// Copy of players/native/src/drive/driver.h by `python -m avatar_shaders`; do not edit.
#pragma once
#include "../pose/clip.h"

namespace avatar {

/// Makes poses of one avatar from captured frames: ARKit weights, rotations of head and eyes.
class Driver {
public:
    /// A driver of an avatar, which must live as long. `within_range` limits each expression to its trained range and
    /// each eyelid to 0..1. Sets the arena's error if ARKit cannot drive this avatar, and for a joint that cannot turn.
    void make(const Avatar& avatar, bool within_range, Arena& arena);

    /// Writes the pose of a frame. What the frame does not move is at rest. Allocates nothing.
    void pose(const AvatarFrame& frame, Pose& into);

private:
    /// A weight that an output of the matrix gives.
    struct Weight {
        size_t row;  // of the matrix
        bool late;
        size_t column;  // of the pose's weights
        double low, high;
    };

    /// A joint that driving turns.
    struct Joint {
        size_t joint;
        bool from_matrix;
        int64_t rows[3];     // of the matrix, for the axes x, y, z; -1: none
        double rest[12];     // [3, 4] linear part of mesh_from_joint at rest
        double inverse[12];
        bool is_head, is_left_eye, is_right_eye;
    };

    void make_weights(bool within_range, Arena& arena);
    void make_joints(Arena& arena);
    void multiply_weights(const float* given);
    void turn_joint(const Joint& turn, const AvatarFrame& frame, Pose& into) const;
    void turn_eye(double* rotation, const double* measured, const float* given, const char* side, bool turned) const;
    void turn_whole(const AvatarFrame& frame, Pose& into) const;
    void set_euler(double* into, const double* turned, const double* signs) const;

    const Avatar* avatar_ = nullptr;
    Span<int32_t> columns_;  // input -> place in arkit_names; -1: it stays 0
    Span<double> values_;    // [outputs]
    Span<Weight> weights_;
    Span<Joint> joints_;
    bool has_head_ = false;
};

}  // namespace avatar
