#pragma once
#include "../pack/model.h"

namespace avatar {

/// Sparse rows of vertices: entry e adds weights[column[e]] * value[e] to vertex row[e].
struct MeshEntries {
    Span<uint32_t> row;
    Span<uint32_t> column;
    Span<double> value;  // [E, channels]

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
