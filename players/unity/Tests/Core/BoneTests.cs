using System;
using System.Collections.Generic;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>Poses as bones of a left-handed engine and back, judged by Python's numbers.</summary>
    public sealed class BoneTests {
        private const double Rounding = 1.0 / (1L << 52); // of float64
        // A chain of five products and inverses; the weights that the references were made with are float32.
        private const double Limit = (1 << 16) * Rounding;
        // Of a flat bone the pseudo-inverse and the split go by squares of its columns.
        private const double FlatLimit = 1e-7;

        private static readonly string[] Names = {
            "bound_elsewhere", "head_bone", "joints", "joints_exact", "joints_wide", "left", "left_names", "scaled", "surface",
        };

        private static Dictionary<string, double[]> Want(string name) => Cases.Tensors("bones", name, "bones.safetensors");

        /// <summary>Bones may have lost shear; the pose that they give shows what the engine shows, to rounding.</summary>
        [Test]
        public void PosesBecomeTheBonesOfPythonAndBonesThePoseThatTheyShow() {
            foreach (string name in Names) {
                LoadedAvatar avatar = Cases.Loaded("bones", name);
                Dictionary<string, double[]> all = Want(name);
                int count = all["regular"].Length;
                var pose = new AvatarPose(avatar);
                for (int t = 0; t < count; t++) {
                    pose.Take(all, t);
                    Check(avatar, pose, all.ToDictionary(one => one.Key, one => one.Value.Row(t, count)), name + " pose " + t);
                }
            }
        }

        private static void Check(LoadedAvatar avatar, AvatarPose pose, Dictionary<string, double[]> want, string what) {
            var frames = new BoneFrames(avatar);
            var bones = new Bones(avatar.Skeleton.Names.Length);
            bool regular = want["regular"][0] == 1;
            double limit = (regular ? Limit : FlatLimit) * Near.Largest(want["skin"]);
            frames.ToBones(pose, bones);
            if (regular) CheckParts(bones, want, limit, what); // a flat bone may be split in several ways that show the same
            CheckShown(avatar, pose, bones, want["skin"], limit, what + " as C# splits it");
            want["translation"].CopyTo(bones.Translation, 0);
            want["rotation_xyzw"].CopyTo(bones.Rotation, 0);
            want["scale"].CopyTo(bones.Scale, 0);
            CheckShown(avatar, pose, bones, want["skin"], limit, what + " as Python splits it");
            double[] translation = new double[3], rotation = new double[4];
            frames.ToRoot(pose, translation, rotation);
            Near.Check(translation, want["root_translation"], 0, what);
            Near.Check(rotation, want["root_rotation_xyzw"], Limit, what);
            var made = new AvatarPose(avatar);
            frames.FromRoot(translation, rotation, made);
            Near.Check(made.WorldFromAvatar, pose.WorldFromAvatar, Limit, what);
        }

        /// <summary>The pose that bones give shows what the engine shows of them: skin matrices [J, 4, 4].</summary>
        private static void CheckShown(LoadedAvatar avatar, AvatarPose pose, Bones bones, double[] skin, double limit, string what) {
            var made = new AvatarPose(avatar);
            pose.ExpressionWeights.CopyTo(made.ExpressionWeights, 0);
            made.JointDelta[3] = 7; // is written anew
            new BoneFrames(avatar).FromBones(bones, made);
            var chain = new Chain(avatar.Skeleton);
            chain.Update(made.ExpressionWeights, made.JointDelta);
            Near.Check(chain.Skin, skin.Where((_, k) => k % 16 < 12), limit, what);
        }

        private static void CheckParts(Bones bones, Dictionary<string, double[]> want, double limit, string what, string rest = "") {
            Near.Check(bones.Translation, want[rest + "translation"], limit, what + " translation");
            Near.Check(bones.Scale, want[rest + "scale"], limit, what + " scale");
            Near.Check(bones.Rotation, want[rest + "rotation_xyzw"], limit, what + " rotation");
        }

        [Test]
        public void RestAndBindPosesAreThoseOfPython() {
            foreach (string name in Names) {
                LoadedAvatar avatar = Cases.Loaded("bones", name);
                var frames = new BoneFrames(avatar);
                var bones = new Bones(avatar.Skeleton.Names.Length);
                frames.Rest(new AvatarPose(avatar), bones);
                CheckParts(bones, Want(name), Limit, name, "rest_");
                Near.Check(frames.Binds(), Want(name)["binds"], Limit, name);
            }
        }

        [Test]
        public void WhatHasNoBonesIsRefused() {
            LoadedAvatar avatar = Cases.Loaded("joints");
            var pose = new AvatarPose(avatar);
            pose.JointDelta[3] = 1e200;
            Action<string, TestDelegate> refused = (field, code) => Assert.AreEqual(field, Assert.Throws<AvatarError>(code).Field);
            refused("rig", () => new BoneFrames(Cases.Loaded("surface_without_rig")));
            refused("joint root", () => new BoneFrames(avatar).ToBones(pose, new Bones(5)));
            avatar.Skeleton.RestLocal[3] = 1e200;
            refused("joint root", () => new BoneFrames(avatar));
        }
    }
}
