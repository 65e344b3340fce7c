using System;

namespace AvatarExport.Core {
    /// <summary>A recorded motion of an avatar. Frame t of an array begins at t times its row.</summary>
    public sealed class Clip {
        private const double AtFrame = 1e-6; // of a frame: nearer times are that frame

        /// <summary>The name of the motion.</summary>
        public string Name;

        /// <summary>Frames a second.</summary>
        public double Fps;

        /// <summary>How many frames there are, T.</summary>
        public int Frames;

        /// <summary>[T, K]</summary>
        public float[] ExpressionWeights;

        /// <summary>[T, L]</summary>
        public float[] LateWeights;

        /// <summary>[T, J, 4, 4] rotation and translation of a joint against its rest.</summary>
        public float[] JointDelta;

        /// <summary>[T, 4, 4] rigid.</summary>
        public float[] WorldFromAvatar;

        [ThreadStatic]
        private static Interpolation between;

        /// <summary>From the first frame to the last.</summary>
        public double Seconds => (Frames - 1) / Fps;

        /// <summary>
        /// Writes the pose at a time into a pose of the same avatar; times beyond the ends are those of the
        /// ends. Frames are exact. Between two frames weights are linear. A matrix is split into a rotation and what
        /// remains (Gram-Schmidt: scale and shear); quaternions are mixed and normalised, the remainder and the
        /// translation are linear. Allocates nothing but for a thread's first call.
        /// </summary>
        public void Pose(double seconds, AvatarPose into) {
            between = between ?? new Interpolation();
            double place = Math.Min(Math.Max(seconds * Fps, 0), Frames - 1);
            if (double.IsNaN(place)) place = 0;
            double nearest = Math.Floor(place + 0.5);
            bool exact = Math.Abs(place - nearest) < AtFrame;
            int first = (int)(exact ? nearest : Math.Floor(place));
            int second = exact ? first : first + 1;
            double part = exact ? 0 : place - first;
            Linear(into.ExpressionWeights, ExpressionWeights, first, second, part);
            Linear(into.LateWeights, LateWeights, first, second, part);
            Matrices(into.JointDelta, JointDelta, first, second, part);
            Matrices(into.WorldFromAvatar, WorldFromAvatar, first, second, part);
        }

        private static void Linear(float[] result, float[] rows, int first, int second, double part) {
            int a = first * result.Length, b = second * result.Length;
            for (int i = 0; i < result.Length; i++) result[i] = (float)((1 - part) * rows[a + i] + part * rows[b + i]);
        }

        private static void Matrices(double[] result, float[] rows, int first, int second, double part) {
            int a = first * result.Length, b = second * result.Length;
            for (int at = 0; at < result.Length; at += 16) between.Write(result, at, rows, a + at, b + at, part);
        }
    }
}
