using System;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>Clips: exact at frames, between them as documented.</summary>
    public sealed class ClipTests {
        [TestCase("joints")]
        [TestCase("joints_exact")]
        [TestCase("left")]
        public void ClipsAreExactAtFramesAndHoldAtTheEnds(string name) {
            LoadedAvatar avatar = Cases.Loaded(name);
            var pose = new AvatarPose(avatar);
            foreach (Clip clip in avatar.Clips) {
                Assert.AreEqual((clip.Frames - 1) / clip.Fps, clip.Seconds);
                for (int frame = -2; frame < clip.Frames + 2; frame++) {
                    clip.Pose(frame / clip.Fps, pose);
                    CheckFrame(clip, pose, Math.Min(Math.Max(frame, 0), clip.Frames - 1));
                }
                clip.Pose(double.NaN, pose);
                CheckFrame(clip, pose, 0);
            }
        }

        private static void CheckFrame(Clip clip, AvatarPose pose, int frame) {
            Assert.AreEqual(Row(clip.ExpressionWeights, frame, pose.ExpressionWeights.Length), pose.ExpressionWeights);
            Assert.AreEqual(Row(clip.LateWeights, frame, pose.LateWeights.Length), pose.LateWeights);
            Assert.AreEqual(Row(clip.JointDelta, frame, pose.JointDelta.Length), pose.JointDelta);
            Assert.AreEqual(Row(clip.WorldFromAvatar, frame, 16), pose.WorldFromAvatar);
        }

        private static float[] Row(float[] values, int frame, int size) => values.Skip(frame * size).Take(size).ToArray();

        [TestCase(0.2, 0.0)]
        [TestCase(1.5, 0.0)]
        [TestCase(3.1, 2.9)]
        public void BetweenFramesRotationsTurnAndScalesAreLinear(double angle, double start) {
            double[] first = Transform(start, new double[] { 1, 2, 3 }, new double[] { 0, 1, 2 });
            double[] second = Transform(start + angle, new double[] { 2, 2, -1 }, new double[] { 4, 1, 0 });
            double[] still = Transform(0, new double[] { 1, 1, 1 }, new double[3]);
            var clip = new Clip {
                Fps = 10,
                Frames = 2,
                ExpressionWeights = new float[] { 0, 1 },
                LateWeights = new float[0],
                JointDelta = first.Concat(second).Select(one => (float)one).ToArray(),
                WorldFromAvatar = still.Concat(still).Select(one => (float)one).ToArray(),
            };
            var pose = new AvatarPose(new LoadedAvatar {
                Expressions = new[] { new Expression { Name = "a", Aliases = new string[0], High = 1 } },
                Eyelids = new string[0],
                Skeleton = new Skeleton { Names = new[] { "j" } },
            });
            clip.Pose(0.05, pose);
            double[] half = Transform(start + angle / 2, new[] { 1.5, 2, 1 }, new double[] { 2, 1, 1 });
            Near.Check(pose.JointDelta, half, 64 * Cases.Rounding, "angle " + angle + " from " + start);
            Assert.AreEqual(0.5, pose.ExpressionWeights[0]);
        }

        /// <summary>A rotation about the axis (2, 3, 6) / 7 by Rodrigues' formula, times a scale of each column.</summary>
        private static double[] Transform(double angle, double[] scale, double[] translation) {
            double[] n = { 2 / 7.0, 3 / 7.0, 6 / 7.0 };
            double[] cross = { 0, -n[2], n[1], n[2], 0, -n[0], -n[1], n[0], 0 };
            var m = new double[16];
            for (int i = 0; i < 9; i++) {
                int row = i / 3, column = i % 3;
                double turned = (row == column ? Math.Cos(angle) : 0) + (1 - Math.Cos(angle)) * n[row] * n[column];
                m[4 * row + column] = (turned + Math.Sin(angle) * cross[i]) * scale[column];
                m[4 * row + 3] = translation[row];
            }
            m[15] = 1;
            return m;
        }
    }
}
