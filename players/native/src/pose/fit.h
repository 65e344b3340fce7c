#pragma once
#include "../formats/memory.h"

namespace avatar {

/// Jacobi's method on a symmetric matrix [n, n], in place: its diagonal becomes the eigenvalues, the rows of `vectors`
/// [n, n] the eigenvectors, of unit length. Returns the index of the largest eigenvalue.
int solve_eigen(double* m, double* vectors, int n);

/// The weighted mean [3] of points [A, 3] with weights [A].
void set_mean(double* out, Span<double> points, Span<double> weights);

/// Writes the rigid transform [3, 4] that takes points `from` to points `to` ([A, 3] each) with weights [A] best: least
/// squares, no reflection (Kabsch). `centre` [3] is the weighted mean of `from`. The rotation is that of the quaternion
/// that Horn's symmetric 4x4 matrix stretches most. B. K. P. Horn, "Closed-form solution of absolute orientation using
/// unit quaternions", JOSA A 4, 1987.
void set_rigid_fit(double* out, Span<double> from, Span<double> to, Span<double> weights, const double* centre);

}  // namespace avatar
