// Copy of players/native/src/pose/affine.h by `python -m avatar_shaders`; do not edit.
#pragma once

// Affine transforms as 12 numbers, rows of a [3, 4] matrix for column vectors. No function allocates.
namespace avatar {

/// out = a b. `out` may be a or b.
void multiply(double* out, const double* a, const double* b);

/// The inverse of the 3x3 part, rows four apart. They may be the same.
void invert_linear(double* out, const double* m);

/// out = a b of 3x3 parts whose rows are four apart; translations stay. `out` may be a or b.
void multiply_linear(double* out, const double* a, const double* b);

/// Writes the identity [3, 4] or, with 4 rows, [4, 4].
void set_identity(double* out, int rows);

/// The rotation factor of the 3x3 part, in place: Newton steps R = (R + R^-T) / 2.
void make_polar(double* m, unsigned steps);

/// The rotation of a rotation vector (axis times angle, radians) as a 3x3 part.
void set_rotation(double* out, double x, double y, double z);

/// The rotation of a unit quaternion as a 3x3 part.
void set_from_quat(double* out, double w, double x, double y, double z);

/// The unit quaternion (w, x, y, z) of a rotation, rows four apart; its largest component is positive.
void quat_from_matrix(double* quat_wxyz, const double* m);

/// out = a b, row-major 4x4 each; `out` is another array.
void multiply4(double* out, const float* a, const double* b);

}  // namespace avatar
