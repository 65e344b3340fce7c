using System;
using System.Collections.Generic;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests
{
    /// <summary>Stage joints, driving and names, judged by Python's numbers.</summary>
    [TestFixture]
    public sealed class PoseTests
    {
        // Python rounds skin matrices to float32 before it skins anchors and mixes joints; here everything is float64.
        private const double Roundings = 16 * Cases.Rounding;

        [Test]
        public void PosesGiveWhatPythonComputes()
        {
            foreach (string name in Cases.Packs())
            {
                Core.Avatar avatar = Cases.Loaded(name);
                Dictionary<string, Tensor> want = Cases.Tensors(name, "poses.safetensors");
                var poser = new Poser(avatar);
                var pose = new Core.Pose(avatar);
                for (int t = 0; t < want["pose_floats"].Shape[0]; t++)
                {
                    want["expression_weights"].Fill(t, pose.ExpressionWeights);
                    want["late_weights"].Fill(t, pose.LateWeights);
                    want["joint_delta"].Fill(t, pose.JointDelta);
                    want["world_from_avatar"].Fill(t, pose.WorldFromAvatar);
                    Posed posed = poser.Update(pose);
                    Close(posed.PoseFloats, want["pose_floats"], t, name + " floats");
                    Close(posed.GroupMatrix, want["group_matrix"], t, name + " matrix");
                    Close(posed.GroupRotation, want["group_rotation"], t, name + " rotation");
                    Assert.AreEqual(want["world_from_avatar"].At(t), posed.WorldFromAvatar, name);
                }
            }
        }

        private static void Close(float[] got, Tensor want, int t, string what)
        {
            double[] expected = want.At(t);
            Near.Check(got, expected, Roundings * Near.Largest(expected), what + " of pose " + t);
        }

        [Test]
        public void DrivingAndJointsRepeatTheReference()
        {
            foreach (string name in Cases.Packs().Where(one => one != "surface_without_rig"))
            {
                string cases = System.Text.Encoding.UTF8.GetString(Cases.Bytes(name, "driving.json"));
                Reference reference = Reference.Parse(cases, Cases.Bytes(name, "driving.safetensors"));
                ConformReport report = Conform.Run(Cases.Loaded(name), reference, null);
                string[] failed = report.Rows.Where(row => !row.Verdict.Passed)
                    .Select(row => name + " " + row.Case + " " + row.Stage + " " + row.Output + " " + row.Verdict.Used).ToArray();
                Assert.AreEqual(new string[0], failed);
                Assert.IsTrue(report.Passed, name);
                Assert.AreEqual(new[] { "driving", "joints" }, report.Rows.Select(row => row.Stage).Distinct().OrderBy(one => one));
            }
        }

        [Test]
        public void ADrivenPoseLeavesNothingOfTheOneBefore()
        {
            Core.Avatar avatar = Cases.Loaded("joints");
            Core.Pose pose = new Core.Pose(avatar), fresh = new Core.Pose(avatar);
            for (int i = 0; i < pose.ExpressionWeights.Length; i++) pose.ExpressionWeights[i] = 3;
            for (int i = 0; i < pose.LateWeights.Length; i++) pose.LateWeights[i] = 3;
            for (int i = 0; i < pose.JointDelta.Length; i++) pose.JointDelta[i] = 3;
            for (int i = 0; i < 16; i++) pose.WorldFromAvatar[i] = 3;
            var driver = new Driver(avatar);
            driver.Pose(new DrivingFrame(), pose);
            driver.Pose(new DrivingFrame(), fresh);
            Same(fresh, pose);
        }

        private static void Same(Core.Pose want, Core.Pose got)
        {
            Assert.AreEqual(want.ExpressionWeights, got.ExpressionWeights);
            Assert.AreEqual(want.LateWeights, got.LateWeights);
            Assert.AreEqual(want.JointDelta, got.JointDelta);
            Assert.AreEqual(want.WorldFromAvatar, got.WorldFromAvatar);
        }

        [Test]
        public void AnAvatarWithoutAMappingCannotBeDriven()
        {
            AvatarError error = Assert.Throws<AvatarError>(() => new Driver(Cases.Loaded("surface_without_rig")));
            Assert.AreEqual("driving", error.Field);
        }

        [Test]
        public void AJointThatIsFlatCannotTurn()
        {
            Core.Avatar avatar = Cases.Loaded("joints");
            for (int at = 16; at <= 24; at += 4) avatar.Skeleton.RestLocal[at] *= 1e-7;
            AvatarError error = Assert.Throws<AvatarError>(() => new Driver(avatar));
            Assert.AreEqual("joint neck", error.Field);
        }

        [Test]
        public void NamesAndAliasesSetWeights()
        {
            Core.Avatar avatar = Cases.Loaded("joints");
            Core.Pose pose = new Core.Pose(avatar), other = new Core.Pose(avatar);
            pose.SetExpression("jaw_open", 0.5);
            pose.SetExpression("exp_003", -1);
            pose.SetEyelid("right", 0.25);
            pose.SetJoint("jaw", Math.PI / 2, 0, 0);
            Assert.AreEqual(new[] { 0.5, 0, 0, -1 }, pose.ExpressionWeights);
            Assert.AreEqual(new[] { 0, 0.25 }, pose.LateWeights);
            double[] turned = { 1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1 };
            Near.Check(pose.JointDelta.Skip(32).Take(16), turned, 1e-15, "jaw");
            other.Copy(pose);
            Same(pose, other);
            pose.Reset();
            Same(new Core.Pose(avatar), pose);
        }

        [Test]
        public void AJointThatIsTurnedByNameTurnsAlikeInPacksOfBothHandednesses()
        {
            Core.Pose right = new Core.Pose(Cases.Loaded("joints")), left = new Core.Pose(Cases.Loaded("left"));
            foreach (Core.Pose pose in new[] { right, left }) pose.SetJoint("jaw", 0.3, -0.7, 0.5);
            double[] mirrored = right.JointDelta.Select((m, i) => (i % 16 < 4) != (i % 4 == 0) ? -m : m).ToArray();
            Near.Check(left.JointDelta, mirrored, 1e-15, "jaw"); // S M S
        }

        [Test]
        public void UnknownNamesListNearOnes()
        {
            var pose = new Core.Pose(Cases.Loaded("joints"));
            AvatarError error = Assert.Throws<AvatarError>(() => pose.SetExpression("jawOpn", 1));
            StringAssert.Contains("'jawOpn' is not an expression of this avatar; did you mean jawOpen", error.Message);
            error = Assert.Throws<AvatarError>(() => pose.SetJoint("zzz", 0, 0, 0));
            StringAssert.Contains("'zzz' is not a joint of this avatar; there are 5: root, neck", error.Message);
            Assert.Throws<AvatarError>(() => pose.SetEyelid("constructor", 0));
            error = Assert.Throws<AvatarError>(() => pose.SetExpression("jawOpen", double.NaN));
            Assert.AreEqual("expression jawOpen", error.Field);
            error = Assert.Throws<AvatarError>(() => pose.SetJoint("jaw", double.PositiveInfinity, 0, 0));
            Assert.AreEqual("joint jaw", error.Field);
        }
    }
}
