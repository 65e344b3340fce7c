using System;
using AvatarExport.Core;
using NUnit.Framework;
using UnityEngine;

namespace AvatarExport.Tests {
    /// <summary>The skinned mesh, its blend shapes and the bones, and how they and other sources make a pose.</summary>
    public sealed class RigTests {
        private LoadedAvatar avatar;
        private SkinnedMeshRenderer proxy;
        private Transform[] bones;
        private RigLink rig;
        private PoseLayers layers;
        private AvatarPose pose;

        [SetUp]
        public void Build() {
            avatar = Packs.Read(Packs.Joints);
            var owner = new GameObject("owner");
            bones = AvatarRig.Build(owner.transform, avatar, AvatarRig.MakeMesh(avatar), HideFlags.HideAndDontSave, out proxy);
            rig = new RigLink(avatar, proxy.transform.parent, proxy, bones);
            layers = new PoseLayers(avatar);
            pose = new AvatarPose(avatar);
        }

        [Test]
        public void MeshHasAShapeForEachExpressionAndEyelid() {
            Assert.AreEqual(avatar.Expressions.Length + avatar.Eyelids.Length, proxy.sharedMesh.blendShapeCount);
            ProxyMesh told = ProxyMesh.From(avatar);
            Vector3[] vertices = proxy.sharedMesh.vertices;
            Assert.AreEqual(told.Positions.Length / 3, vertices.Length);
            Assert.AreEqual(new[] { -told.Positions[3], told.Positions[4] }, new[] { vertices[1].x, vertices[1].y });
            int[] triangles = proxy.sharedMesh.triangles; // mirrored, so turned
            Assert.AreEqual(new[] { told.Triangles[1], told.Triangles[2] }, new[] { triangles[2], triangles[1] });
            LoadedAvatar without = Packs.Read(Packs.WithoutRig);
            Assert.AreEqual(without.Expressions.Length + without.Eyelids.Length, AvatarRig.MakeMesh(without).blendShapeCount);
        }

        [Test]
        public void BindPosesUndoTheBonesAtRestAndPathsAreThoseOfTheObjects() {
            string[] paths = AvatarRig.BonePaths(avatar);
            Transform root = proxy.transform.parent;
            for (int i = 0; i < bones.Length; i++) {
                Matrix4x4 world = Local(bones[i]);
                string path = bones[i].name;
                for (Transform at = bones[i].parent; at != root; at = at.parent) {
                    world = Local(at) * world;
                    path = at.name + "/" + path;
                }
                Matrix4x4 skin = world * proxy.sharedMesh.bindposes[i];
                for (int k = 0; k < 16; k++) Assert.AreEqual(k % 5 == 0 ? 1 : 0, skin[k / 4, k % 4], 1e-5, "bone " + i);
                Assert.AreEqual(root.name + "/" + path, paths[i]);
            }
        }

        [Test]
        public void ABoneThatMovesPosesItsJointAlone() {
            int joint = bones.Length - 1;
            layers.Mix(pose, null, 0, rig, null);
            AssertRest();
            bones[joint].localRotation = bones[joint].localRotation * new Quaternion(0, 0.6f, 0, 0.8f);
            layers.Mix(pose, null, 0, rig, null);
            for (int k = 0; k < 16 * joint; k++) Assert.AreEqual(k % 16 % 5 == 0 ? 1 : 0, pose.JointDelta[k], 0);
            // The joint's frame has other axes than the bone; the angle is the same. cos = 1 - 2 sin^2 of half of it.
            double trace = pose.JointDelta[16 * joint] + pose.JointDelta[16 * joint + 5]
                + pose.JointDelta[16 * joint + 10];
            Assert.AreEqual(1 + 2 * (1 - 2 * 0.36), trace, 1e-5);
            layers.SetJoint(avatar.Skeleton.Names[joint], 0, 0, 0);
            layers.Mix(pose, null, 0, rig, null);
            AssertRest(); // what scripts set wins
        }

        [Test]
        public void WhatIsWrittenIsThePoseForASecondRigAndNoMovementForTheFirst() {
            layers.SetExpression(avatar.Expressions[0].Name, 0.5f);
            layers.SetJoint(avatar.Skeleton.Names[1], 0.2, -0.3, 0.1);
            for (int i = 0; i < 3; i++) layers.Mix(pose, null, 0, rig, null);
            Assert.AreEqual(50, proxy.GetBlendShapeWeight(0), 1e-4);
            var read = new AvatarPose(avatar);
            new PoseLayers(avatar).Mix(read, null, 0, new RigLink(avatar, proxy.transform.parent, proxy, bones), null);
            AssertNear(pose, read, 1e-5);
            layers.ClearScript();
            for (int i = 0; i < 3; i++) layers.Mix(pose, null, 0, rig, null);
            AssertRest();
        }

        [Test]
        public void LaterSourcesWin() {
            Clip clip = avatar.Clips[0];
            double time = 0.5 * clip.Seconds;
            var alone = new AvatarPose(avatar);
            FixedFace live = null;
            Action<int, double, string> check = (expression, weight, what) => {
                layers.Mix(pose, clip, time, rig, live);
                Assert.AreEqual(weight, pose.ExpressionWeights[expression], 1e-6, what);
            };
            clip.Pose(time, alone);
            check(2, alone.ExpressionWeights[2], "clip");
            proxy.SetBlendShapeWeight(2, 33);
            check(2, 0.33, "blend shape over clip");
            check(1, alone.ExpressionWeights[1], "clip where no shape moved");
            layers.SetExpression(avatar.Expressions[2].Name, 0.9f);
            layers.SetExpression(avatar.Expressions[0].Name, 0.7f);
            check(2, 0.9, "script over blend shape");
            live = new GameObject("live").AddComponent<FixedFace>();
            var frame = new DrivingFrame();
            var driven = new AvatarPose(avatar);
            live.Read(frame);
            new Driver(avatar).Pose(frame, driven);
            Assert.AreNotEqual(alone.ExpressionWeights[0], driven.ExpressionWeights[0]);
            check(0, driven.ExpressionWeights[0], "live input over all");
            check(2, 0.9, "script where live input sets nothing");
            live.IsSeen = false;
            check(0, 0.7, "no face: script again");
        }

        private void AssertRest() => AssertNear(new AvatarPose(avatar), pose, 0);

        private static void AssertNear(AvatarPose want, AvatarPose got, double limit) {
            for (int i = 0; i < want.ExpressionWeights.Length; i++) {
                Assert.AreEqual(want.ExpressionWeights[i], got.ExpressionWeights[i], limit, "expression " + i);
            }
            for (int i = 0; i < want.JointDelta.Length; i++) Assert.AreEqual(want.JointDelta[i], got.JointDelta[i], limit, "delta " + i);
            for (int i = 0; i < 16; i++) Assert.AreEqual(want.WorldFromAvatar[i], got.WorldFromAvatar[i], limit, "world " + i);
        }

        private static Matrix4x4 Local(Transform one) {
            Quaternion q = one.localRotation;
            Vector3 s = one.localScale, t = one.localPosition;
            var made = new Matrix4x4 { m03 = t.x, m13 = t.y, m23 = t.z, m33 = 1 };
            for (int i = 0; i < 3; i++) {
                int j = (i + 1) % 3, k = (i + 2) % 3;
                made[i, i] = (1 - 2 * (q[j] * q[j] + q[k] * q[k])) * s[i];
                made[i, j] = 2 * (q[i] * q[j] - q.w * q[k]) * s[j];
                made[i, k] = 2 * (q[i] * q[k] + q.w * q[j]) * s[k];
            }
            return made;
        }
    }

    /// <summary>A face that opens its jaw.</summary>
    public sealed class FixedFace : ArkitSource {
        internal bool IsSeen = true;

        /// <inheritdoc/>
        public override bool Read(DrivingFrame into) {
            into.Weights[Array.IndexOf(Arkit.Names, "jawOpen")] = 0.25f;
            return IsSeen;
        }
    }
}
