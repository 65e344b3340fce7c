#pragma once
#include "../pose/poser.h"
#include "light.h"

namespace avatar {

/// Where the values of a frame lie for an avatar of some groups: the sources in their order, tables group by group.
class FrameLayout {
public:
    explicit FrameLayout(size_t groups);

    /// How many floats there are.
    size_t size() const { return size_; }
    /// The first float of a value, or of a table of groups, by its place in frame_sources.
    size_t first(uint32_t source) const { return first_[source]; }
    /// First float and count of "world_row0" or "group_matrix_row1[2]". The pack's check has refused other names.
    size_t place(Text source, uint32_t* floats) const;

private:
    size_t first_[frame_source_count];
    size_t size_ = 0;
};

/// The values of one frame that passes ask for by name, for one avatar. Setting them allocates nothing.
struct FrameValues {
    explicit FrameValues(size_t group_count) : layout(group_count), groups(group_count) {}

    FrameLayout layout;
    size_t groups;
    Span<float> floats;

    /// Takes the results of stage joints: group tables [G, 3, 4] and the pose's world matrix [4, 4].
    void set_posed(const float* group_matrix, const float* group_rotation, const double* world_from_avatar);
    /// The world matrix alone.
    void set_world(const double* world_from_avatar);

    /// Takes the camera, seen from the pack's own space: `world` [4, 4] places the pack in the scene. Any affine
    /// matrix will do, also one that scales or mirrors. A singular one draws nothing: every Gaussian is at depth 0.
    void set_camera(const AvatarCamera& camera, const double* world);

    /// Takes the light of the scene.
    void set_light(const LightRows& light);

private:
    void set_row(uint32_t source, const double* row);
    void set_table(uint32_t source, const float* table);
};

}  // namespace avatar
