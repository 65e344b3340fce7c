using System;

namespace AvatarExport.Core {
    /// <summary>
    /// Affine matrices between two others. An object holds what it computes with; it allocates nothing later.
    /// </summary>
    internal sealed class Interpolation {
        private readonly double[] first = new double[12]; // rotation of a matrix
        private readonly double[] second = new double[12];
        private readonly double[] restFirst = new double[6]; // what remains: upper triangular
        private readonly double[] restSecond = new double[6];
        private readonly double[] turned = new double[12];
        private readonly double[] quats = new double[8];

        /// <summary>
        /// Writes an affine matrix [4, 4] at result[o]: 1 - part of the one at m[a] and "part" of the one at m[b].
        /// Equal matrices, and a part of 0, give the first one's numbers.
        /// </summary>
        public void Write(double[] result, int o, float[] m, int a, int b, double part) {
            bool same = true;
            for (int k = 0; k < 12 && same && part != 0; k++) same = m[a + k] == m[b + k];
            for (int k = 0; k < 16; k++) result[o + k] = m[a + k];
            if (!same) Mix(result, o, m, a, b, part);
        }

        private void Mix(double[] result, int o, float[] m, int a, int b, double part) {
            Split(first, restFirst, m, a);
            Split(second, restSecond, m, b);
            double keep = 1 - part;
            Turn(keep, part);
            double[] u = restFirst, v = restSecond;
            double xx = keep * u[0] + part * v[0], xy = keep * u[1] + part * v[1], xz = keep * u[2] + part * v[2];
            double yy = keep * u[3] + part * v[3], yz = keep * u[4] + part * v[4], zz = keep * u[5] + part * v[5];
            for (int row = 0; row < 12; row += 4) {
                double x = turned[row], y = turned[row + 1], z = turned[row + 2];
                result[o + row] = x * xx;
                result[o + row + 1] = x * xy + y * yy;
                result[o + row + 2] = x * xz + y * yz + z * zz;
                result[o + row + 3] = keep * m[a + row + 3] + part * m[b + row + 3];
            }
        }

        /// <summary>turned = the rotation between both: quaternions mixed the short way, then normalised.</summary>
        private void Turn(double keep, double part) {
            double[] q = quats;
            Affine.QuatFromMatrix(q, 0, first, 0);
            Affine.QuatFromMatrix(q, 4, second, 0);
            double dot = q[0] * q[4] + q[1] * q[5] + q[2] * q[6] + q[3] * q[7];
            double other = dot < 0 ? -part : part;
            double w = keep * q[0] + other * q[4], x = keep * q[1] + other * q[5];
            double y = keep * q[2] + other * q[6], z = keep * q[3] + other * q[7];
            double scale = 1 / Math.Sqrt(w * w + x * x + y * y + z * z);
            Affine.SetFromQuat(turned, 0, w * scale, x * scale, y * scale, z * scale);
        }

        /// <summary>
        /// m = rotation rest, by Gram-Schmidt on the columns. "rest" is xx, xy, xz, yy, yz, zz; zz is negative for a
        /// mirror.
        /// </summary>
        private static void Split(double[] r, double[] rest, float[] m, int at) {
            double ax = m[at], ay = m[at + 4], az = m[at + 8];
            double bx = m[at + 1], by = m[at + 5], bz = m[at + 9];
            double cx = m[at + 2], cy = m[at + 6], cz = m[at + 10];
            double xx = Math.Sqrt(ax * ax + ay * ay + az * az);
            double ux = ax / xx, uy = ay / xx, uz = az / xx;
            double xy = ux * bx + uy * by + uz * bz;
            double dx = bx - xy * ux, dy = by - xy * uy, dz = bz - xy * uz;
            double yy = Math.Sqrt(dx * dx + dy * dy + dz * dz);
            double vx = dx / yy, vy = dy / yy, vz = dz / yy;
            double wx = uy * vz - uz * vy, wy = uz * vx - ux * vz, wz = ux * vy - uy * vx;
            r[0] = ux; r[1] = vx; r[2] = wx;
            r[4] = uy; r[5] = vy; r[6] = wy;
            r[8] = uz; r[9] = vz; r[10] = wz;
            rest[0] = xx;
            rest[1] = xy;
            rest[2] = ux * cx + uy * cy + uz * cz;
            rest[3] = yy;
            rest[4] = vx * cx + vy * cy + vz * cz;
            rest[5] = wx * cx + wy * cy + wz * cz;
        }
    }
}
