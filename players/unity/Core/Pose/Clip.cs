using System;

namespace AvatarExport.Core
{
    /// <summary>A recorded motion of an avatar. Sampling allocates nothing.</summary>
    public sealed class Clip
    {
        private const double AtFrame = 1e-6; // of a frame: nearer times are that frame

        private readonly ClipData data;
        private readonly Interpolation between = new Interpolation();

        /// <summary>Clip "index" of an avatar. Throws AvatarError if there is no such clip.</summary>
        public Clip(Avatar avatar, int index)
        {
            if (index < 0 || index >= avatar.Clips.Length)
            {
                int last = avatar.Clips.Length - 1;
                string have = last < 0 ? "this avatar has none" : $"the last one is clip {last}";
                throw new AvatarError($"there is no clip {index}; {have}", avatar.Name, "clips");
            }
            data = avatar.Clips[index];
            Name = data.Name;
            Fps = data.Fps;
            Seconds = (data.Frames - 1) / data.Fps;
        }

        /// <summary>The clip's name.</summary>
        public string Name { get; }

        /// <summary>Frames a second.</summary>
        public double Fps { get; }

        /// <summary>From the first frame to the last.</summary>
        public double Seconds { get; }

        /// <summary>
        /// Writes the pose at a time into "pose", a pose of the same avatar; times beyond the ends are those of the
        /// ends. Frames are exact. Between two frames weights are linear. A matrix is split into a rotation and what
        /// remains (Gram-Schmidt: scale and shear); quaternions are mixed and normalised, the remainder and the
        /// translation are linear.
        /// </summary>
        public void Sample(double seconds, Pose pose)
        {
            double place = Math.Min(Math.Max(seconds * Fps, 0), data.Frames - 1);
            if (double.IsNaN(place)) place = 0;
            double nearest = Math.Floor(place + 0.5);
            bool exact = Math.Abs(place - nearest) < AtFrame;
            int first = (int)(exact ? nearest : Math.Floor(place));
            int second = exact ? first : first + 1;
            double part = exact ? 0 : place - first;
            Linear(pose.ExpressionWeights, data.ExpressionWeights, first, second, part);
            Linear(pose.LateWeights, data.LateWeights, first, second, part);
            Matrices(pose.JointDelta, data.JointDelta, first, second, part);
            Matrices(pose.WorldFromAvatar, data.WorldFromAvatar, first, second, part);
        }

        private static void Linear(float[] result, float[] rows, int first, int second, double part)
        {
            int a = first * result.Length, b = second * result.Length;
            for (int i = 0; i < result.Length; i++) result[i] = (float)((1 - part) * rows[a + i] + part * rows[b + i]);
        }

        private void Matrices(double[] result, float[] rows, int first, int second, double part)
        {
            int a = first * result.Length, b = second * result.Length;
            for (int at = 0; at < result.Length; at += 16) between.Write(result, at, rows, a + at, b + at, part);
        }
    }
}
