using System;

namespace AvatarExport.Core {
    /// <summary>
    /// The rigid fit of one set of points to another (Kabsch): least squares, no reflection. The rotation is that of
    /// the quaternion that Horn's symmetric 4x4 matrix stretches most, found by Jacobi's method. B. K. P. Horn,
    /// "Closed-form solution of absolute orientation using unit quaternions", JOSA A 4, 1987.
    /// </summary>
    internal sealed class RigidFit {
        private readonly double[] matrix = new double[16];
        private readonly double[] vectors = new double[16];
        private readonly double[] mean = new double[3]; // of the points "to"

        /// <summary>
        /// Writes the rigid transform [3, 4] that takes points "from" to points "to" ([A, 3] each) with weights [A]
        /// best. "centre" [3] is the weighted mean of "from".
        /// </summary>
        public void Write(double[] result, double[] from, double[] to, double[] weights, double[] centre) {
            SetMean(mean, to, weights);
            SetHorn(from, to, weights, centre);
            int q = 4 * Eigen.Solve(matrix, vectors, 4);
            Affine.SetFromQuat(result, 0, vectors[q], vectors[q + 1], vectors[q + 2], vectors[q + 3]);
            for (int c = 0, row = 0; c < 3; c++, row += 4) {
                double turned = result[row] * centre[0] + result[row + 1] * centre[1] + result[row + 2] * centre[2];
                result[row + 3] = mean[c] - turned;
            }
        }

        /// <summary>The weighted mean [3] of points [A, 3].</summary>
        public static void SetMean(double[] result, double[] points, double[] weights) {
            double sum = 0;
            Array.Clear(result, 0, 3);
            for (int i = 0; i < weights.Length; i++) {
                sum += weights[i];
                for (int c = 0; c < 3; c++) result[c] += weights[i] * points[3 * i + c];
            }
            for (int c = 0; c < 3; c++) result[c] /= sum;
        }

        /// <summary>matrix = Horn's matrix of the covariance of both sets of points about their means.</summary>
        private void SetHorn(double[] from, double[] to, double[] weights, double[] centre) {
            double xx = 0, xy = 0, xz = 0, yx = 0, yy = 0, yz = 0, zx = 0, zy = 0, zz = 0;
            for (int i = 0; i < weights.Length; i++) {
                double weight = weights[i];
                double ax = weight * (from[3 * i] - centre[0]);
                double ay = weight * (from[3 * i + 1] - centre[1]);
                double az = weight * (from[3 * i + 2] - centre[2]);
                double bx = to[3 * i] - mean[0], by = to[3 * i + 1] - mean[1], bz = to[3 * i + 2] - mean[2];
                xx += ax * bx; xy += ax * by; xz += ax * bz;
                yx += ay * bx; yy += ay * by; yz += ay * bz;
                zx += az * bx; zy += az * by; zz += az * bz;
            }
            double[] m = matrix;
            m[0] = xx + yy + zz;
            m[1] = m[4] = yz - zy;
            m[2] = m[8] = zx - xz;
            m[3] = m[12] = xy - yx;
            m[5] = xx - yy - zz;
            m[6] = m[9] = xy + yx;
            m[7] = m[13] = zx + xz;
            m[10] = yy - xx - zz;
            m[11] = m[14] = yz + zy;
            m[15] = zz - xx - yy;
        }
    }
}
