using System;

namespace AvatarExport.Core {
    /// <summary>A small still picture of an avatar, drawn on the CPU in the pose in which it was bound.</summary>
    public static class Icon {
        private const double Border = 1.12; // of the longer side of the avatar
        private const double Outliers = 0.005; // part of the splats on each side that may lie outside the picture
        private const double Cut = 3.33; // standard deviations: there a splat of opacity 1 falls below 1 / 255

        /// <summary>
        /// RGBA of `size` x `size` pixels, 8 bits each, not premultiplied, the first row at the bottom. The avatar is seen
        /// from its front, without perspective. It takes the coarsest level that is meant for this size.
        /// </summary>
        public static byte[] Draw(LoadedAvatar avatar, int size) {
            RestSplats splats = RestSplats.Of(avatar, Levels.For(avatar.Levels, size));
            var canvas = new Canvas(avatar, splats, size);
            int[] order = FarToNear(splats, canvas.Front);
            for (int i = 0; i < order.Length; i++) canvas.Add(splats, order[i]);
            return canvas.Bytes();
        }

        private static int[] FarToNear(RestSplats splats, double[] front) {
            int count = splats.Opacity.Length;
            var depth = new double[count];
            var order = new int[count];
            for (int i = 0; i < count; i++) {
                for (int k = 0; k < 3; k++) depth[i] += front[k] * splats.Mean[3 * i + k];
                order[i] = i;
            }
            Array.Sort(depth, order);
            return order;
        }

        /// <summary>A float image, and the two axes of space that it shows.</summary>
        private sealed class Canvas {
            internal readonly double[] Front;
            private readonly double[] right = new double[3];
            private readonly double[] up; // these three in the frame of the pack
            private readonly double centreX, centreY; // along right and up, metres
            private readonly double pixelsPerMetre;
            private readonly int size;
            private readonly double[] rgba; // premultiplied, [size, size, 4], the first row at the bottom

            internal Canvas(LoadedAvatar avatar, RestSplats splats, int size) {
                this.size = size;
                rgba = new double[4 * size * size];
                Front = (double[])avatar.Framing.Front.Clone();
                up = (double[])avatar.Framing.Up.Clone();
                for (int i = 0; i < 3; i++) {
                    int j = (i + 1) % 3, k = (i + 2) % 3;
                    right[i] = up[j] * Front[k] - up[k] * Front[j];
                }
                foreach (double[] axis in new[] { right, up, Front }) {
                    if (avatar.Handedness == "left") axis[0] = -axis[0];
                }
                double width, height;
                centreX = Middle(splats, right, out width);
                centreY = Middle(splats, up, out height);
                pixelsPerMetre = size / (Border * Math.Max(Math.Max(width, height), 1e-6));
            }

            /// <summary>Middle and width of the avatar along an axis, metres.</summary>
            private static double Middle(RestSplats splats, double[] axis, out double width) {
                var places = new double[splats.Opacity.Length];
                for (int i = 0; i < places.Length; i++) places[i] = Along(axis, splats.Mean, 3 * i);
                Array.Sort(places);
                int outside = (int)(Outliers * places.Length);
                double low = places[outside], high = places[places.Length - 1 - outside];
                width = high - low;
                return (low + high) / 2;
            }

            private static double Along(double[] axis, double[] points, int at) {
                return axis[0] * points[at] + axis[1] * points[at + 1] + axis[2] * points[at + 2];
            }

            /// <summary>Blends a splat over what is there.</summary>
            internal void Add(RestSplats splats, int index) {
                double x = (Along(right, splats.Mean, 3 * index) - centreX) * pixelsPerMetre + (size - 1) / 2.0;
                double y = (Along(up, splats.Mean, 3 * index) - centreY) * pixelsPerMetre + (size - 1) / 2.0;
                double xx = Spread(splats.Covariance, index, right, right) + Constants.LowPass;
                double yy = Spread(splats.Covariance, index, up, up) + Constants.LowPass;
                double xy = Spread(splats.Covariance, index, right, up);
                double determinant = xx * yy - xy * xy;
                double wide = Cut * Math.Sqrt(xx), high = Cut * Math.Sqrt(yy);
                if (!(determinant > 0) || !(Math.Abs(x) < 1e6) || !(Math.Abs(y) < 1e6)) return;
                int left = (int)Math.Ceiling(Math.Max(0, x - wide)), last = (int)Math.Floor(Math.Min(size - 1, x + wide));
                int bottom = (int)Math.Ceiling(Math.Max(0, y - high)), top = (int)Math.Floor(Math.Min(size - 1, y + high));
                for (int row = bottom; row <= top; row++) {
                    for (int column = left; column <= last; column++) {
                        double dx = column - x, dy = row - y;
                        double power = (yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / determinant;
                        double alpha = Math.Min(Constants.AlphaMax, splats.Opacity[index] * Math.Exp(-power / 2));
                        if (alpha * Constants.AlphaMinDenominator >= 1) Blend(4 * (row * size + column), alpha, splats.Colour, 3 * index);
                    }
                }
            }

            private void Blend(int at, double alpha, double[] colour, int from) {
                for (int i = 0; i < 3; i++) rgba[at + i] += alpha * (colour[from + i] - rgba[at + i]);
                rgba[at + 3] += alpha * (1 - rgba[at + 3]);
            }

            /// <summary>a^T covariance b in square pixels.</summary>
            private double Spread(double[] covariance, int index, double[] a, double[] b) {
                int o = 6 * index;
                double x = covariance[o] * b[0] + covariance[o + 1] * b[1] + covariance[o + 2] * b[2];
                double y = covariance[o + 1] * b[0] + covariance[o + 3] * b[1] + covariance[o + 4] * b[2];
                double z = covariance[o + 2] * b[0] + covariance[o + 4] * b[1] + covariance[o + 5] * b[2];
                return (a[0] * x + a[1] * y + a[2] * z) * pixelsPerMetre * pixelsPerMetre;
            }

            internal byte[] Bytes() {
                var bytes = new byte[rgba.Length];
                for (int at = 0; at < bytes.Length; at += 4) {
                    double alpha = rgba[at + 3];
                    for (int i = 0; i < 3 && alpha > 0; i++) bytes[at + i] = Rounded(rgba[at + i] / alpha);
                    bytes[at + 3] = Rounded(alpha);
                }
                return bytes;
            }

            private static byte Rounded(double value) {
                return (byte)Math.Floor(255 * Math.Min(1, Math.Max(0, value)) + 0.5);
            }
        }
    }
}
