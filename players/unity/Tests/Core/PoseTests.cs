using System;
using System.Collections.Generic;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>Stage joints, driving and names, judged by Python's numbers.</summary>
    public sealed class PoseTests {
        // Python rounds skin matrices to float32 before it skins anchors and mixes joints; here everything is float64.
        private const double Roundings = 16;

        [Test]
        public void PosesGiveWhatPythonComputes() {
            foreach (string name in Cases.Packs()) {
                LoadedAvatar avatar = Cases.Loaded(name);
                Dictionary<string, double[]> want = Cases.Tensors(name, "poses.safetensors");
                int count = want["world_from_avatar"].Length / 16;
                var poser = new Poser(avatar);
                var pose = new AvatarPose(avatar);
                for (int t = 0; t < count; t++) {
                    pose.Take(want, t);
                    Posed posed = poser.Update(pose);
                    Near.Round(posed.PoseFloats, want["pose_floats"].Row(t, count), Roundings, name + " floats");
                    Near.Round(posed.GroupMatrix, want["group_matrix"].Row(t, count), Roundings, name + " matrix");
                    Near.Round(posed.GroupRotation, want["group_rotation"].Row(t, count), Roundings, name + " rotation");
                    Assert.AreEqual(want["world_from_avatar"].Row(t, count), posed.WorldFromAvatar, name);
                }
            }
        }

        [Test]
        public void DrivingAndJointsRepeatTheReference() {
            foreach (string name in Cases.Packs().Where(one => one != "surface_without_rig")) {
                Reference reference = Reference.Parse(Cases.Text(name, "driving.json"), Cases.Bytes(name, "driving.safetensors"));
                ConformReport report = Conform.Run(Cases.Loaded(name), reference, null);
                string[] failed = report.Rows.Where(row => !row.Verdict.Passed)
                    .Select(row => name + " " + row.Case + " " + row.Stage + " " + row.Output + " " + row.Verdict.Used).ToArray();
                Assert.AreEqual(new string[0], failed);
                Assert.IsTrue(report.Passed, name);
                Assert.AreEqual(new[] { "driving", "joints" }, report.Rows.Select(row => row.Stage).Distinct().OrderBy(one => one));
            }
        }

        [Test]
        public void ADrivenPoseLeavesNothingOfTheOneBefore() {
            LoadedAvatar avatar = Cases.Loaded("joints");
            AvatarPose pose = new AvatarPose(avatar), fresh = new AvatarPose(avatar);
            for (int i = 0; i < pose.ExpressionWeights.Length; i++) pose.ExpressionWeights[i] = 3;
            for (int i = 0; i < pose.LateWeights.Length; i++) pose.LateWeights[i] = 3;
            for (int i = 0; i < pose.JointDelta.Length; i++) pose.JointDelta[i] = 3;
            for (int i = 0; i < 16; i++) pose.WorldFromAvatar[i] = 3;
            var driver = new Driver(avatar);
            driver.Pose(new DrivingFrame(), pose);
            driver.Pose(new DrivingFrame(), fresh);
            Near.Same(fresh, pose);
        }

        [Test]
        public void WhatCannotBeDrivenIsRefused() {
            Assert.AreEqual("driving", Assert.Throws<AvatarError>(() => new Driver(Cases.Loaded("surface_without_rig"))).Field);
            LoadedAvatar avatar = Cases.Loaded("joints");
            for (int at = 16; at <= 24; at += 4) avatar.Skeleton.RestLocal[at] *= 1e-7; // a flat joint
            Assert.AreEqual("joint neck", Assert.Throws<AvatarError>(() => new Driver(avatar)).Field);
        }

        [Test]
        public void NamesAndAliasesSetWeights() {
            LoadedAvatar avatar = Cases.Loaded("joints");
            AvatarPose pose = new AvatarPose(avatar), other = new AvatarPose(avatar);
            pose.SetExpression("jaw_open", 0.5);
            pose.SetExpression("exp_003", -1);
            pose.SetEyelid("right", 0.25);
            pose.SetJoint("jaw", Math.PI / 2, 0, 0);
            Assert.AreEqual(new[] { 0.5, 0, 0, -1 }, pose.ExpressionWeights);
            Assert.AreEqual(new[] { 0, 0.25 }, pose.LateWeights);
            double[] turned = { 1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1 };
            Near.Check(pose.JointDelta.Skip(32).Take(16), turned, 1e-15, "jaw");
            other.Copy(pose);
            Near.Same(pose, other);
            pose.Reset();
            Near.Same(new AvatarPose(avatar), pose);
        }

        [Test]
        public void AJointThatIsTurnedByNameTurnsAlikeInPacksOfBothHandednesses() {
            AvatarPose right = new AvatarPose(Cases.Loaded("joints")), left = new AvatarPose(Cases.Loaded("left"));
            foreach (AvatarPose pose in new[] { right, left }) pose.SetJoint("jaw", 0.3, -0.7, 0.5);
            double[] mirrored = right.JointDelta.Select((m, i) => (i % 16 < 4) != (i % 4 == 0) ? -m : m).ToArray();
            Near.Check(left.JointDelta, mirrored, 1e-15, "jaw"); // S M S
        }

        [Test]
        public void UnknownNamesListNearOnes() {
            var pose = new AvatarPose(Cases.Loaded("joints"));
            Action<string, TestDelegate> refused = (told, code) => StringAssert.Contains(told, Assert.Throws<AvatarError>(code).Message);
            refused("'jawOpn' is not an expression of this avatar; did you mean jawOpen", () => pose.SetExpression("jawOpn", 1));
            refused("'zzz' is not a joint of this avatar; there are 5: root, neck", () => pose.SetJoint("zzz", 0, 0, 0));
            refused("not an eyelid", () => pose.SetEyelid("constructor", 0));
            refused("expression jawOpen: ", () => pose.SetExpression("jawOpen", double.NaN));
            refused("joint jaw: ", () => pose.SetJoint("jaw", double.PositiveInfinity, 0, 0));
        }
    }
}
