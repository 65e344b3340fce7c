using System;

namespace AvatarExport.Core {
    /// <summary>
    /// Affine transforms as 12 numbers, rows of a [3, 4] matrix for column vectors, at an offset of an array.
    /// No method allocates.
    /// </summary>
    internal static class Affine {
        /// <summary>out = a b. "out" may be a or b. Rows are 4 numbers apart.</summary>
        public static void Multiply(double[] result, int o, double[] a, int i, double[] b, int j) {
            double b0 = b[j], b1 = b[j + 1], b2 = b[j + 2], b3 = b[j + 3];
            double b4 = b[j + 4], b5 = b[j + 5], b6 = b[j + 6], b7 = b[j + 7];
            double b8 = b[j + 8], b9 = b[j + 9], b10 = b[j + 10], b11 = b[j + 11];
            for (int row = 0; row < 12; row += 4) {
                double x = a[i + row], y = a[i + row + 1], z = a[i + row + 2], t = a[i + row + 3];
                result[o + row] = x * b0 + y * b4 + z * b8;
                result[o + row + 1] = x * b1 + y * b5 + z * b9;
                result[o + row + 2] = x * b2 + y * b6 + z * b10;
                result[o + row + 3] = x * b3 + y * b7 + z * b11 + t;
            }
        }

        /// <summary>
        /// The inverse of the 3x3 part of a transform at i, into result[o..], rows four apart. They may be the same.
        /// </summary>
        public static void InvertLinear(double[] result, int o, double[] m, int i) {
            double a = m[i], b = m[i + 1], c = m[i + 2];
            double d = m[i + 4], e = m[i + 5], f = m[i + 6];
            double g = m[i + 8], h = m[i + 9], k = m[i + 10];
            double scale = 1 / (a * (e * k - f * h) - b * (d * k - f * g) + c * (d * h - e * g));
            result[o] = (e * k - f * h) * scale;
            result[o + 1] = (c * h - b * k) * scale;
            result[o + 2] = (b * f - c * e) * scale;
            result[o + 4] = (f * g - d * k) * scale;
            result[o + 5] = (a * k - c * g) * scale;
            result[o + 6] = (c * d - a * f) * scale;
            result[o + 8] = (d * h - e * g) * scale;
            result[o + 9] = (b * g - a * h) * scale;
            result[o + 10] = (a * e - b * d) * scale;
        }

        /// <summary>The determinant of the 3x3 part of a transform at i, rows four apart.</summary>
        public static double Determinant(double[] m, int i) {
            return m[i] * (m[i + 5] * m[i + 10] - m[i + 6] * m[i + 9])
                - m[i + 1] * (m[i + 4] * m[i + 10] - m[i + 6] * m[i + 8])
                + m[i + 2] * (m[i + 4] * m[i + 9] - m[i + 5] * m[i + 8]);
        }

        /// <summary>The inverse of the affine transform at i, into result[o..]. They may be the same.</summary>
        public static void Invert(double[] result, int o, double[] m, int i) {
            double x = m[i + 3], y = m[i + 7], z = m[i + 11];
            InvertLinear(result, o, m, i);
            for (int at = o; at < o + 12; at += 4) {
                result[at + 3] = -(result[at] * x + result[at + 1] * y + result[at + 2] * z);
            }
        }

        /// <summary>out = a b of 3x3 parts whose rows are four apart; translations stay. "out" may be a or b.</summary>
        public static void MultiplyLinear(double[] result, int o, double[] a, int i, double[] b, int j) {
            double b0 = b[j], b1 = b[j + 1], b2 = b[j + 2];
            double b4 = b[j + 4], b5 = b[j + 5], b6 = b[j + 6];
            double b8 = b[j + 8], b9 = b[j + 9], b10 = b[j + 10];
            for (int row = 0; row < 12; row += 4) {
                double x = a[i + row], y = a[i + row + 1], z = a[i + row + 2];
                result[o + row] = x * b0 + y * b4 + z * b8;
                result[o + row + 1] = x * b1 + y * b5 + z * b9;
                result[o + row + 2] = x * b2 + y * b6 + z * b10;
            }
        }

        /// <summary>Writes the identity [3, 4] or, with 4 rows, [4, 4].</summary>
        public static void SetIdentity(double[] result, int o, int rows) {
            for (int k = 0; k < 4 * rows; k++) result[o + k] = k % 5 == 0 ? 1 : 0;
        }

        /// <summary>
        /// The rotation factor of the 3x3 part at o, rows four apart, in place: Newton steps R = (R + R^-T) / 2.
        /// "inverse" [12] is overwritten.
        /// </summary>
        public static void Polar(double[] m, int o, int steps, double[] inverse) {
            for (int step = 0; step < steps; step++) {
                InvertLinear(inverse, 0, m, o);
                for (int row = 0; row < 3; row++) {
                    for (int column = 0; column < 3; column++) {
                        int at = o + 4 * row + column;
                        m[at] = (m[at] + inverse[4 * column + row]) / 2;
                    }
                }
            }
        }

        /// <summary>
        /// The rotation of a rotation vector (axis times angle, radians) as a 3x3 part at o, rows four apart.
        /// </summary>
        public static void SetRotation(double[] result, int o, double x, double y, double z) {
            double angle = Math.Sqrt(x * x + y * y + z * z);
            double sine = angle > 0 ? Math.Sin(angle / 2) / angle : 0;
            SetFromQuat(result, o, Math.Cos(angle / 2), x * sine, y * sine, z * sine);
        }

        /// <summary>The rotation of a unit quaternion as a 3x3 part at o, rows four apart.</summary>
        public static void SetFromQuat(double[] result, int o, double w, double x, double y, double z) {
            result[o] = 1 - 2 * (y * y + z * z);
            result[o + 1] = 2 * (x * y - w * z);
            result[o + 2] = 2 * (x * z + w * y);
            result[o + 4] = 2 * (x * y + w * z);
            result[o + 5] = 1 - 2 * (x * x + z * z);
            result[o + 6] = 2 * (y * z - w * x);
            result[o + 8] = 2 * (x * z - w * y);
            result[o + 9] = 2 * (y * z + w * x);
            result[o + 10] = 1 - 2 * (x * x + y * y);
        }

        /// <summary>
        /// The unit quaternion (w, x, y, z) of the rotation at i, rows four apart; its largest component is positive.
        /// </summary>
        public static void QuatFromMatrix(double[] result, int o, double[] m, int i) {
            double d0 = m[i], d1 = m[i + 5], d2 = m[i + 10];
            double ww = 1 + d0 + d1 + d2, xx = 1 + d0 - d1 - d2, yy = 1 - d0 + d1 - d2, zz = 1 - d0 - d1 + d2;
            double a = m[i + 9] - m[i + 6], b = m[i + 2] - m[i + 8], c = m[i + 4] - m[i + 1];
            double d = m[i + 4] + m[i + 1], e = m[i + 2] + m[i + 8], f = m[i + 9] + m[i + 6];
            double most = Math.Max(Math.Max(ww, xx), Math.Max(yy, zz));
            double scale = 1 / (2 * Math.Sqrt(most));
            result[o] = (most == ww ? ww : most == xx ? a : most == yy ? b : c) * scale;
            result[o + 1] = (most == ww ? a : most == xx ? xx : most == yy ? d : e) * scale;
            result[o + 2] = (most == ww ? b : most == xx ? d : most == yy ? yy : f) * scale;
            result[o + 3] = (most == ww ? c : most == xx ? e : most == yy ? f : zz) * scale;
        }

        /// <summary>out = a b, row-major 4x4 each; "out" is another array.</summary>
        public static void Multiply4(double[] result, float[] a, double[] b) {
            for (int row = 0; row < 16; row += 4) {
                for (int column = 0; column < 4; column++) {
                    result[row + column] = a[row] * b[column] + a[row + 1] * b[4 + column]
                        + a[row + 2] * b[8 + column] + a[row + 3] * b[12 + column];
                }
            }
        }
    }
}
