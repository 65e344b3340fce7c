using System;
using System.Collections.Generic;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests
{
    /// <summary>Poses as bones of a left-handed engine and back, judged by Python's numbers.</summary>
    [TestFixture]
    public sealed class BoneTests
    {
        private const double Rounding = 1.0 / (1L << 52); // of float64
        // A chain of five products and inverses; the weights that the references were made with are float32.
        private const double Roundings = 1 << 16;
        // Of a flat bone the pseudo-inverse and the split go by squares of its columns.
        private const double FlatLimit = 1e-7;

        private static readonly string[] Names =
        {
            "bound_elsewhere", "head_bone", "joints", "joints_exact", "joints_wide", "left", "left_names", "scaled", "surface",
        };

        private static Core.Avatar Loaded(string name)
        {
            return Pack.Read(Cases.Bytes("bones", name, "pack.avatar"), name);
        }

        private static void EachPose(Action<string, Core.Avatar, Core.Pose, Dictionary<string, Tensor>, int> check)
        {
            foreach (string name in Names)
            {
                Core.Avatar avatar = Loaded(name);
                Dictionary<string, Tensor> want = Cases.Tensors("bones", name, "bones.safetensors");
                var pose = new Core.Pose(avatar);
                for (int t = 0; t < want["shown"].Shape[0]; t++)
                {
                    want["expression_weights"].Fill(t, pose.ExpressionWeights);
                    want["joint_delta"].Fill(t, pose.JointDelta);
                    want["world_from_avatar"].Fill(t, pose.WorldFromAvatar);
                    check(name + " pose " + t, avatar, pose, want, t);
                }
            }
        }

        private static double Limit(Dictionary<string, Tensor> want, int t)
        {
            double largest = Near.Largest(want["shown"].At(t));
            return want["regular"].Values[t] == 1 ? Roundings * Rounding * largest : FlatLimit * largest;
        }

        [Test]
        public void PosesBecomeTheBonesOfPython()
        {
            EachPose((what, avatar, pose, want, t) =>
            {
                Bones bones = Of(want, t);
                new BoneFrames(avatar).ToBones(pose, bones);
                double limit = Limit(want, t);
                Near.Check(Shown(bones, avatar.Skeleton.Parents), want["shown"].At(t), limit, what + " shown");
                if (want["regular"].Values[t] != 1) return;
                Near.Check(bones.Translation, want["translation"].At(t), limit, what + " translation");
                Near.Check(bones.Scale, want["scale"].At(t), limit, what + " scale");
                Near.Check(bones.Rotation, want["rotation_xyzw"].At(t), limit, what + " rotation");
            });
        }

        /// <summary>
        /// Bones may have lost shear; the pose that they give shows what the engine shows, to rounding.
        /// </summary>
        [Test]
        public void BonesBecomeThePoseThatTheyShow()
        {
            EachPose((what, avatar, pose, want, t) =>
            {
                var made = new Core.Pose(avatar);
                Array.Copy(pose.ExpressionWeights, made.ExpressionWeights, made.ExpressionWeights.Length);
                new BoneFrames(avatar).FromBones(Of(want, t), made);
                var chain = new Chain(avatar.Skeleton);
                chain.Update(made.ExpressionWeights, made.JointDelta);
                double[] skin = want["skin"].At(t).Where((_, k) => k % 16 < 12).ToArray();
                Near.Check(chain.Skin, skin, Limit(want, t), what);
            });
        }

        [Test]
        public void BonesGiveThePoseBackThatMadeThem()
        {
            foreach (string name in Names.Where(one => one != "scaled")) // whose rest pose shears what turns
            {
                Core.Avatar avatar = Loaded(name);
                Core.Pose pose = new Core.Pose(avatar), back = new Core.Pose(avatar);
                var random = new Random(3);
                for (int k = 0; k < pose.ExpressionWeights.Length; k++)
                {
                    pose.ExpressionWeights[k] = (float)random.NextDouble();
                }
                foreach (string joint in avatar.Skeleton.Names)
                {
                    pose.SetJoint(joint, random.NextDouble() * 3 - 1.5, random.NextDouble() * 3 - 1.5, random.NextDouble() * 3 - 1.5);
                }
                back.Copy(pose);
                back.JointDelta[3] = 7; // is written anew
                var frames = new BoneFrames(avatar);
                var bones = new Bones(avatar.Skeleton.Names.Length);
                frames.ToBones(pose, bones);
                frames.FromBones(bones, back);
                // Inverse bind matrices are float32: the rest pose of bones, which is rigid, is theirs to its rounding.
                Near.Check(back.JointDelta, pose.JointDelta, 64 * Cases.Rounding, name);
            }
        }

        [Test]
        public void RestAndBindPosesAreThoseOfPython()
        {
            foreach (string name in Names)
            {
                Core.Avatar avatar = Loaded(name);
                Dictionary<string, Tensor> want = Cases.Tensors("bones", name, "bones.safetensors");
                var frames = new BoneFrames(avatar);
                var bones = new Bones(avatar.Skeleton.Names.Length);
                frames.Rest(new Core.Pose(avatar), bones);
                Near.Check(bones.Translation, want["rest_translation"].Values, Roundings * Rounding, name);
                Near.Check(bones.Rotation, want["rest_rotation_xyzw"].Values, Roundings * Rounding, name);
                Near.Check(bones.Scale, want["rest_scale"].Values, Roundings * Rounding, name);
                Near.Check(frames.Binds(), want["binds"].Values, Roundings * Rounding, name);
            }
        }

        [Test]
        public void TheObjectAboveTheBonesMovesTheWhole()
        {
            EachPose((what, avatar, pose, want, t) =>
            {
                double[] translation = new double[3], rotation = new double[4], world = (double[])pose.WorldFromAvatar.Clone();
                var frames = new BoneFrames(avatar);
                frames.ToRoot(pose, translation, rotation);
                Near.Check(translation, want["root_translation"].At(t), 0, what);
                Near.Check(rotation, want["root_rotation_xyzw"].At(t), Roundings * Rounding, what);
                frames.FromRoot(translation, rotation, pose);
                Near.Check(pose.WorldFromAvatar, world, Roundings * Rounding, what);
            });
        }

        [Test]
        public void WhatHasNoBonesIsRefused()
        {
            AvatarError error = Assert.Throws<AvatarError>(() => new BoneFrames(Cases.Loaded("surface_without_rig")));
            Assert.AreEqual("rig", error.Field);
            Core.Avatar avatar = Cases.Loaded("joints");
            var pose = new Core.Pose(avatar);
            pose.JointDelta[3] = 1e200;
            error = Assert.Throws<AvatarError>(() => new BoneFrames(avatar).ToBones(pose, new Bones(5)));
            Assert.AreEqual("joint root", error.Field);
            avatar.Skeleton.RestLocal[3] = 1e200;
            error = Assert.Throws<AvatarError>(() => new BoneFrames(avatar));
            Assert.AreEqual("joint root", error.Field);
        }

        private static Bones Of(Dictionary<string, Tensor> want, int t)
        {
            var bones = new Bones(want["translation"].Row / 3);
            want["translation"].Fill(t, bones.Translation);
            want["rotation_xyzw"].Fill(t, bones.Rotation);
            want["scale"].Fill(t, bones.Scale);
            return bones;
        }

        /// <summary>Mesh from bone [J, 4, 4] as an engine computes it: T R S down the chain.</summary>
        private static double[] Shown(Bones bones, int[] parents)
        {
            var shown = new double[16 * parents.Length];
            for (int j = 0; j < parents.Length; j++)
            {
                double[] local = Local(bones, j);
                for (int i = 0; i < 16; i++)
                {
                    shown[16 * j + i] = parents[j] < 0 ? local[i] : Enumerable.Range(0, 4)
                        .Sum(k => shown[16 * parents[j] + i / 4 * 4 + k] * local[4 * k + i % 4]);
                }
            }
            return shown;
        }

        /// <summary>T R S; column c is the axis c turned by the quaternion: v + 2 u x (w v + u x v).</summary>
        private static double[] Local(Bones bones, int j)
        {
            double[] u = bones.Rotation.Skip(4 * j).Take(3).ToArray();
            double w = bones.Rotation[4 * j + 3];
            var local = new double[16];
            for (int c = 0; c < 3; c++)
            {
                double[] v = Enumerable.Range(0, 3).Select(i => i == c ? 1.0 : 0).ToArray();
                double[] once = Cross(u, v), twice = Cross(u, v.Select((one, i) => w * one + once[i]).ToArray());
                for (int i = 0; i < 3; i++) local[4 * i + c] = (v[i] + 2 * twice[i]) * bones.Scale[3 * j + c];
                local[4 * c + 3] = bones.Translation[3 * j + c];
            }
            local[15] = 1;
            return local;
        }

        private static double[] Cross(double[] a, double[] b)
        {
            return new[] { a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0] };
        }
    }
}
