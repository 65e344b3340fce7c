using System;

namespace AvatarExport.Core {
    /// <summary>Eigenvalues and eigenvectors of small symmetric matrices, without allocation.</summary>
    internal static class Eigen {
        private const int MostSweeps = 32;
        private const double Epsilon = 2.220446049250313e-16; // of float64

        /// <summary>
        /// Jacobi's method on a symmetric matrix [n, n], in place: its diagonal becomes the eigenvalues, the rows of
        /// "vectors" [n, n] the eigenvectors, of unit length. Returns the index of the largest eigenvalue.
        /// </summary>
        public static int Solve(double[] m, double[] vectors, int n) {
            for (int i = 0; i < n * n; i++) vectors[i] = i % (n + 1) == 0 ? 1 : 0;
            for (int sweep = 0; sweep < MostSweeps && OffDiagonal(m, n) > 0; sweep++) {
                for (int p = 0; p < n; p++) {
                    for (int q = p + 1; q < n; q++) Rotate(m, vectors, n, p, q);
                }
            }
            int best = 0;
            for (int i = 1; i < n; i++) best = m[i * (n + 1)] > m[best * (n + 1)] ? i : best;
            return best;
        }

        /// <summary>The sum of sizes off the diagonal; 0 where they do not count beside the diagonal.</summary>
        private static double OffDiagonal(double[] m, int n) {
            double off = 0, on = 0;
            for (int p = 0; p < n; p++) {
                on += Math.Abs(m[p * (n + 1)]);
                for (int q = p + 1; q < n; q++) off += Math.Abs(m[p * n + q]);
            }
            return off <= Epsilon * Epsilon * on ? 0 : off;
        }

        /// <summary>Turns axes p and q so that m[p, q] becomes 0.</summary>
        private static void Rotate(double[] m, double[] vectors, int n, int p, int q) {
            double off = m[p * n + q];
            if (off == 0) return;
            double half = (m[q * (n + 1)] - m[p * (n + 1)]) / (2 * off);
            double tangent = (half < 0 ? -1 : 1) / (Math.Abs(half) + Math.Sqrt(half * half + 1));
            double cosine = 1 / Math.Sqrt(tangent * tangent + 1);
            double sine = tangent * cosine;
            for (int k = 0; k < n; k++) {
                double a = m[k * n + p], b = m[k * n + q];
                m[k * n + p] = cosine * a - sine * b;
                m[k * n + q] = sine * a + cosine * b;
            }
            for (int k = 0; k < n; k++) {
                double a = m[p * n + k], b = m[q * n + k];
                m[p * n + k] = cosine * a - sine * b;
                m[q * n + k] = sine * a + cosine * b;
                double c = vectors[p * n + k], d = vectors[q * n + k];
                vectors[p * n + k] = cosine * c - sine * d;
                vectors[q * n + k] = sine * c + cosine * d;
            }
            m[p * n + q] = m[q * n + p] = 0;
        }
    }
}
