using System;

namespace AvatarExport.Core {
    /// <summary>
    /// The rotation nearest to a matrix, and its pseudo-inverse. An object holds what it computes with.
    /// </summary>
    internal sealed class NearestRotation {
        private const int MostSteps = 60;
        private const double Converged = 1e-15; // change of an element of a rotation in a step
        private const double Flat = 1e-14; // a determinant beside the cube of the size that does not count

        private readonly double[] inverse = new double[12];
        private readonly double[] square = new double[9];
        private readonly double[] axes = new double[9]; // rows: eigenvectors of M^T M
        private readonly double[] stretched = new double[9]; // rows: what M makes of them, of unit length

        /// <summary>
        /// Writes the rotation nearest to the 3x3 part of m (rows four apart, as the result's); of a reflection that
        /// nearest to its negative, so that a scale takes the sign. Of a flat matrix, where several are nearest, it is
        /// one of them.
        /// </summary>
        public void Write(double[] result, double[] m) {
            if (IsFlat(m, 0)) {
                WriteFlat(result, m);
                return;
            }
            double sign = Affine.Determinant(m, 0) < 0 ? -1 : 1;
            for (int k = 0; k < 12; k++) result[k] = k % 4 == 3 ? 0 : sign * m[k];
            double change = double.PositiveInfinity;
            for (int step = 0; step < MostSteps && change > Converged; step++) {
                Affine.InvertLinear(inverse, 0, result, 0);
                double scale = change > 0.1 ? Math.Sqrt(Size(inverse, 0) / Size(result, 0)) : 1; // far away it hastens
                change = 0;
                for (int row = 0; row < 3; row++) {
                    for (int column = 0; column < 3; column++) {
                        int at = 4 * row + column;
                        double next = (scale * result[at] + inverse[4 * column + row] / scale) / 2;
                        change = Math.Max(change, Math.Abs(next - result[at]));
                        result[at] = next;
                    }
                }
            }
        }

        /// <summary>
        /// Writes the inverse of the 3x3 part of m at i, rows four apart; of a flat one the pseudo-inverse, which keeps
        /// the part that has one.
        /// </summary>
        public void Invert(double[] result, double[] m, int i) {
            if (!IsFlat(m, i)) {
                Affine.InvertLinear(result, 0, m, i);
                return;
            }
            int largest = SetAxes(m, i);
            Array.Clear(result, 0, 12);
            for (int axis = 0; axis < 3; axis++) {
                double squared = square[4 * axis];
                if (!(squared > Flat * square[4 * largest])) continue;
                for (int column = 0; column < 3; column++) {
                    double along = 0; // (M v)_column
                    for (int k = 0; k < 3; k++) along += m[i + 4 * column + k] * axes[3 * axis + k];
                    for (int row = 0; row < 3; row++) {
                        result[4 * row + column] += axes[3 * axis + row] * along / squared;
                    }
                }
            }
        }

        /// <summary>The Frobenius norm of a 3x3 part.</summary>
        private static double Size(double[] m, int i) {
            double sum = 0;
            for (int k = 0; k < 11; k++) sum += k % 4 == 3 ? 0 : m[i + k] * m[i + k];
            return Math.Sqrt(sum);
        }

        private static bool IsFlat(double[] m, int i) {
            double size = Size(m, i);
            return !(Math.Abs(Affine.Determinant(m, i)) > Flat * size * size * size);
        }

        /// <summary>
        /// axes and the diagonal of square: eigenvectors and eigenvalues of M^T M. Returns the largest one's index.
        /// </summary>
        private int SetAxes(double[] m, int i) {
            for (int k = 0; k < 9; k++) {
                int row = k / 3, column = k % 3;
                square[k] = m[i + row] * m[i + column] + m[i + 4 + row] * m[i + 4 + column] + m[i + 8 + row] * m[i + 8 + column];
            }
            return Eigen.Solve(square, axes, 3);
        }

        private void WriteFlat(double[] result, double[] m) {
            int first = SetAxes(m, 0);
            Affine.SetIdentity(result, 0, 3);
            if (!(square[4 * first] > 0)) return; // 0, or not a number
            int second = square[4 * ((first + 1) % 3)] > square[4 * ((first + 2) % 3)] ? (first + 1) % 3 : (first + 2) % 3;
            Stretch(m, first);
            if (square[4 * second] > Flat * square[4 * first]) Stretch(m, second);
            else SetPerpendicular(first, second);
            int third = 3 - first - second;
            Cross(stretched, first, second, third);
            Cross(axes, first, second, third);
            for (int k = 0; k < 12; k++) {
                if (k % 4 == 3) continue;
                double sum = 0;
                for (int axis = 0; axis < 3; axis++) sum += stretched[3 * axis + k / 4] * axes[3 * axis + k % 4];
                result[k] = sum;
            }
        }

        private void Stretch(double[] m, int axis) {
            double length = 0;
            for (int row = 0; row < 3; row++) {
                double sum = 0;
                for (int k = 0; k < 3; k++) sum += m[4 * row + k] * axes[3 * axis + k];
                stretched[3 * axis + row] = sum;
                length += sum * sum;
            }
            for (int row = 0; row < 3; row++) stretched[3 * axis + row] /= Math.Sqrt(length);
        }

        private void SetPerpendicular(int to, int axis) {
            double[] s = stretched;
            int least = 0;
            for (int k = 1; k < 3; k++) least = Math.Abs(s[3 * to + k]) < Math.Abs(s[3 * to + least]) ? k : least;
            double along = s[3 * to + least], length = Math.Sqrt(1 - along * along);
            for (int k = 0; k < 3; k++) s[3 * axis + k] = ((k == least ? 1 : 0) - along * s[3 * to + k]) / length;
        }

        private static void Cross(double[] rows, int a, int b, int into) {
            for (int k = 0; k < 3; k++) {
                int l = (k + 1) % 3, n = (k + 2) % 3;
                rows[3 * into + k] = rows[3 * a + l] * rows[3 * b + n] - rows[3 * a + n] * rows[3 * b + l];
            }
        }
    }
}
