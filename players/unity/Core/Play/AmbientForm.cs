using System;

namespace AvatarExport.Core {
    /// <summary>One channel of ambient light as a form of the normal n: a constant + vector n + n form n.</summary>
    internal sealed class AmbientForm {
        private readonly double[] vector = new double[3], turnedVector = new double[3];
        private readonly double[] form = new double[9], half = new double[9], turned = new double[9];

        /// <summary>
        /// Writes a channel of rows [9, 4] of the light `ambient` [9, 3] where normals are turned by `turn`, rows four
        /// apart, before they are looked up.
        /// </summary>
        public void Write(double[] ambient, int channel, double[] turn, float[] rows) {
            Read(ambient, channel);
            Turn(turn);
            double[] c1 = Constants.ShC1, c2 = Constants.ShC2, q = turned;
            rows[channel] = (float)ambient[channel];
            rows[4 + channel] = (float)(turnedVector[1] / c1[0]);
            rows[8 + channel] = (float)(turnedVector[2] / c1[1]);
            rows[12 + channel] = (float)(turnedVector[0] / c1[2]);
            rows[16 + channel] = (float)(2 * q[1] / c2[0]);
            rows[20 + channel] = (float)(2 * q[5] / c2[1]);
            rows[24 + channel] = (float)(q[8] / (2 * c2[2]));
            rows[28 + channel] = (float)(2 * q[2] / c2[3]);
            rows[32 + channel] = (float)((q[0] - q[4]) / (2 * c2[4]));
        }

        private void Read(double[] a, int c) {
            double[] c1 = Constants.ShC1, c2 = Constants.ShC2;
            vector[0] = c1[2] * a[9 + c];
            vector[1] = c1[0] * a[3 + c];
            vector[2] = c1[1] * a[6 + c];
            double zz = c2[2] * a[18 + c], xx = c2[4] * a[24 + c];
            form[0] = xx - zz;
            form[4] = -zz - xx;
            form[8] = 2 * zz;
            form[1] = form[3] = c2[0] * a[12 + c] / 2;
            form[5] = form[7] = c2[1] * a[15 + c] / 2;
            form[2] = form[6] = c2[3] * a[21 + c] / 2;
        }

        private void Turn(double[] turn) {
            for (int i = 0; i < 3; i++) {
                turnedVector[i] = turn[i] * vector[0] + turn[4 + i] * vector[1] + turn[8 + i] * vector[2];
                for (int j = 0; j < 3; j++) {
                    half[3 * i + j] = turn[i] * form[j] + turn[4 + i] * form[3 + j] + turn[8 + i] * form[6 + j];
                }
            }
            for (int i = 0; i < 3; i++) {
                for (int j = 0; j < 3; j++) {
                    turned[3 * i + j] = half[3 * i] * turn[j] + half[3 * i + 1] * turn[4 + j] + half[3 * i + 2] * turn[8 + j];
                }
            }
        }
    }
}
