#pragma once
#include "../pack/model.h"

namespace avatar {

/// Linear parts [J, 3, 4] of mesh_from_joint at rest; the fourth column is 0.
Span<double> rest_linear(const Skeleton& skeleton, Arena& arena);

/// Stage joints, float64: skin matrices of a skeleton.
class Chain {
public:
    /// Room for a skeleton, which must live as long. Empty where the arena's error is set.
    void make(const Skeleton& skeleton, Arena& arena);

    /// Computes `skin` of weights [K] and deltas [J, 4, 4].
    void update(const float* weights, const double* delta);

    Span<double> skin;  // mesh from binding mesh, [J, 3, 4]

private:
    void set_rest(const float* weights);
    void set_rest_step(size_t joint, double* into) const;
    void place(size_t joint, const double* parent_from_joint);

    const Skeleton* skeleton_ = nullptr;
    Span<double> local_;         // [J, 3, 4] parent from joint at rest
    Span<double> inverse_bind_;  // [J, 3, 4]
    Span<double> from_mesh_;     // [J, 3, 4] inverse of the linear part of the parent's rest transform
    Span<double> moved_;         // [J, 3] how expressions move rest joints, mesh space
    Span<double> posed_;         // [J, 3, 4]
    Span<uint32_t> moving_;      // expressions that move a joint
};

}  // namespace avatar
