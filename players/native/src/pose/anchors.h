#pragma once
#include "../pack/model.h"

namespace avatar {

/// Sparse rows of vertices: the entries of vertex a, each of which adds weights[column] * value, end at ends[a].
struct MeshEntries {
    Span<uint32_t> ends;
    Span<uint32_t> column;
    Span<float> value;  // [E, channels]

    /// Adds what weights[first + column] move to vertices [A, 3].
    void add_to(Span<double> vertices, const float* weights) const;
};

/// The few vertices of a mesh whose motion moves an "anchor" group: decoded once, posed on the CPU.
class Anchors {
public:
    /// Decodes vertices [A] from the mesh of a program that has been checked. Sets the error if no pass poses one.
    void make(const Program& program, Span<uint32_t> vertices, Arena& arena);

    /// Stages morph and skin: the content of buffer Pose, and skin matrices [J, 3, 4].
    void update(const float* pose, const PoseSections& at, const double* matrices);

    Span<double> rest;   // neutral vertices [A, 3]
    Span<double> posed;  // [A, 3] of the newest update

private:
    Span<double> morphed_;
    MeshEntries morphs_, correctives_, late_, skin_;
};

}  // namespace avatar
