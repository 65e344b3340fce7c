using System;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests
{
    /// <summary>Clips: exact at frames, between them as documented.</summary>
    [TestFixture]
    public sealed class ClipTests
    {
        [Test]
        public void ClipsAreExactAtFramesAndHoldAtTheEnds()
        {
            foreach (string name in new[] { "joints", "joints_exact", "left" })
            {
                Core.Avatar avatar = Cases.Loaded(name);
                var pose = new Core.Pose(avatar);
                for (int index = 0; index < avatar.Clips.Length; index++)
                {
                    var clip = new Clip(avatar, index);
                    ClipData data = avatar.Clips[index];
                    Assert.AreEqual((data.Frames - 1) / data.Fps, clip.Seconds);
                    for (int frame = -2; frame < data.Frames + 2; frame++)
                    {
                        clip.Sample(frame / clip.Fps, pose);
                        CheckFrame(data, pose, Math.Min(Math.Max(frame, 0), data.Frames - 1));
                    }
                    clip.Sample(double.NaN, pose);
                    CheckFrame(data, pose, 0);
                }
            }
        }

        private static void CheckFrame(ClipData data, Core.Pose pose, int frame)
        {
            Assert.AreEqual(Row(data.ExpressionWeights, pose.ExpressionWeights.Length, frame), pose.ExpressionWeights);
            Assert.AreEqual(Row(data.LateWeights, pose.LateWeights.Length, frame), pose.LateWeights);
            Assert.AreEqual(Row(data.JointDelta, pose.JointDelta.Length, frame), pose.JointDelta);
            Assert.AreEqual(Row(data.WorldFromAvatar, 16, frame), pose.WorldFromAvatar);
        }

        private static float[] Row(float[] values, int size, int frame)
        {
            return values.Skip(frame * size).Take(size).ToArray();
        }

        [Test]
        public void ThereIsNoSuchClip()
        {
            foreach (int index in new[] { -1, 0 })
            {
                AvatarError error = Assert.Throws<AvatarError>(() => new Clip(TwoFrames(null, null, 0), index));
                Assert.AreEqual("clips", error.Field);
            }
        }

        [TestCase(0.2, 0.0)]
        [TestCase(1.5, 0.0)]
        [TestCase(3.1, 0.0)]
        [TestCase(0.2, 2.9)]
        [TestCase(3.1, 2.9)]
        public void BetweenFramesRotationsTurnAndScalesAreLinear(double angle, double start)
        {
            double[] first = Transform(start, new double[] { 1, 2, 3 }, new double[] { 0, 1, 2 });
            double[] second = Transform(start + angle, new double[] { 2, 2, -1 }, new double[] { 4, 1, 0 });
            Core.Avatar avatar = TwoFrames(first, second, 1);
            var pose = new Core.Pose(avatar);
            new Clip(avatar, 0).Sample(0.05, pose);
            double[] half = Transform(start + angle / 2, new[] { 1.5, 2, 1 }, new double[] { 2, 1, 1 });
            Near.Check(pose.JointDelta, half, 64 * Cases.Rounding, "angle " + angle + " from " + start);
            Assert.AreEqual(0.5, pose.ExpressionWeights[0]);
        }

        /// <summary>An avatar of one joint, whose clips have two frames with these matrices.</summary>
        private static Core.Avatar TwoFrames(double[] first, double[] second, int clips)
        {
            double[] still = Transform(0, new double[] { 1, 1, 1 }, new double[3]);
            var clip = new ClipData
            {
                Name = "turn",
                Fps = 10,
                Frames = 2,
                ExpressionWeights = new float[] { 0, 1 },
                LateWeights = new float[0],
                JointDelta = (first ?? still).Concat(second ?? still).Select(one => (float)one).ToArray(),
                WorldFromAvatar = still.Concat(still).Select(one => (float)one).ToArray(),
            };
            return new Core.Avatar
            {
                Expressions = new[] { new Expression { Name = "a", Aliases = new string[0], High = 1 } },
                LateMorphs = new string[0],
                Skeleton = new Skeleton { Names = new[] { "j" } },
                Clips = Enumerable.Repeat(clip, clips).ToArray(),
            };
        }

        /// <summary>
        /// A rotation about the axis (2, 3, 6) / 7 by Rodrigues' formula, times a scale of each column.
        /// </summary>
        private static double[] Transform(double angle, double[] scale, double[] translation)
        {
            double[] n = { 2 / 7.0, 3 / 7.0, 6 / 7.0 };
            double[] cross = { 0, -n[2], n[1], n[2], 0, -n[0], -n[1], n[0], 0 };
            var m = new double[16];
            for (int i = 0; i < 3; i++)
            {
                for (int j = 0; j < 3; j++)
                {
                    double turned = (i == j ? Math.Cos(angle) : 0) + (1 - Math.Cos(angle)) * n[i] * n[j];
                    m[4 * i + j] = (turned + Math.Sin(angle) * cross[3 * i + j]) * scale[j];
                }
                m[4 * i + 3] = translation[i];
            }
            m[15] = 1;
            return m;
        }
    }
}
