using System;
using NUnit.Framework;
using UnityEngine;

namespace AvatarExport.Tests
{
    /// <summary>The skinned mesh, its blend shapes and the bones, and how they and other sources make a pose.</summary>
    public sealed class RigTests
    {
        private Core.Avatar avatar;
        private SkinnedMeshRenderer proxy;
        private Transform[] bones;
        private RigLink rig;
        private PoseLayers layers;
        private Core.Pose pose;

        [SetUp]
        public void Build()
        {
            avatar = Packs.Read(Packs.Joints);
            var owner = new GameObject("owner");
            bones = AvatarRig.Build(owner.transform, avatar, AvatarRig.MakeMesh(avatar), HideFlags.HideAndDontSave,
                out proxy);
            rig = new RigLink(avatar, proxy.transform.parent, proxy, bones);
            layers = new PoseLayers(avatar);
            pose = new Core.Pose(avatar);
        }

        [Test]
        public void MeshHasAShapeForEachExpressionAndEyelid()
        {
            int expressions = avatar.Expressions.Length;
            Assert.AreEqual(expressions + avatar.LateMorphs.Length, proxy.sharedMesh.blendShapeCount);
            Core.ProxyMesh told = Core.ProxyMesh.From(avatar);
            Vector3[] vertices = proxy.sharedMesh.vertices;
            Assert.AreEqual(told.Positions.Length / 3, vertices.Length);
            Assert.AreEqual(-told.Positions[3], vertices[1].x, 0);
            Assert.AreEqual(told.Positions[4], vertices[1].y, 0);
            int[] triangles = proxy.sharedMesh.triangles; // mirrored, so turned
            Assert.AreEqual(told.Triangles[1], triangles[2]);
            Assert.AreEqual(told.Triangles[2], triangles[1]);
        }

        [Test]
        public void BindPosesUndoTheBonesAtRest()
        {
            for (int i = 0; i < bones.Length; i++)
            {
                Matrix4x4 world = Local(bones[i]);
                for (Transform at = bones[i].parent; at != proxy.transform.parent; at = at.parent)
                {
                    world = Local(at) * world;
                }
                Matrix4x4 skin = world * proxy.sharedMesh.bindposes[i];
                for (int k = 0; k < 16; k++) Assert.AreEqual(k % 5 == 0 ? 1 : 0, skin[k / 4, k % 4], 1e-5, "bone " + i);
            }
        }

        [Test]
        public void PathsAreThoseOfTheObjects()
        {
            string[] paths = AvatarRig.BonePaths(avatar);
            for (int i = 0; i < bones.Length; i++)
            {
                string path = bones[i].name;
                for (Transform at = bones[i].parent; at.parent != null; at = at.parent) path = at.name + "/" + path;
                Assert.AreEqual(path, paths[i]);
            }
        }

        [Test]
        public void AvatarWithoutARigHasItsBlendShapes()
        {
            Core.Avatar without = Packs.Read(Packs.WithoutRig);
            Mesh mesh = AvatarRig.MakeMesh(without);
            Assert.AreEqual(without.Expressions.Length + without.LateMorphs.Length, mesh.blendShapeCount);
        }

        [Test]
        public void NothingIsMovedAtRest()
        {
            layers.Mix(pose, null, 0, rig, null);
            AssertRest();
        }

        [Test]
        public void ABlendShapeOfAHundredIsAWeightOfOne()
        {
            proxy.SetBlendShapeWeight(1, 150);
            layers.Mix(pose, null, 0, rig, null);
            Assert.AreEqual(1.5, pose.ExpressionWeights[1], 1e-6);
            Assert.AreEqual(0, pose.ExpressionWeights[0], 0);
        }

        [Test]
        public void ABoneThatMovesPosesItsJointAlone()
        {
            int joint = bones.Length - 1;
            bones[joint].localRotation = bones[joint].localRotation * new Quaternion(0, 0.6f, 0, 0.8f);
            layers.Mix(pose, null, 0, rig, null);
            for (int k = 0; k < 16 * joint; k++) Assert.AreEqual(k % 16 % 5 == 0 ? 1 : 0, pose.JointDelta[k], 0);
            // The joint's frame has other axes than the bone; the angle is the same. cos = 1 - 2 sin^2 of half of it.
            double trace = pose.JointDelta[16 * joint] + pose.JointDelta[16 * joint + 5]
                + pose.JointDelta[16 * joint + 10];
            Assert.AreEqual(1 + 2 * (1 - 2 * 0.36), trace, 1e-5);
        }

        [Test]
        public void WhatIsWrittenToBonesIsTheSamePoseForASecondRig()
        {
            layers.SetExpression(avatar.Expressions[0].Name, 0.5f);
            layers.SetJoint(avatar.Skeleton.Names[1], 0.2, -0.3, 0.1);
            layers.Mix(pose, null, 0, rig, null);
            Assert.AreEqual(50, proxy.GetBlendShapeWeight(0), 1e-4);
            var read = new Core.Pose(avatar);
            new PoseLayers(avatar).Mix(read, null, 0, new RigLink(avatar, proxy.transform.parent, proxy, bones), null);
            for (int i = 0; i < read.ExpressionWeights.Length; i++)
            {
                Assert.AreEqual(pose.ExpressionWeights[i], read.ExpressionWeights[i], 1e-6);
            }
            for (int i = 0; i < read.JointDelta.Length; i++)
            {
                Assert.AreEqual(pose.JointDelta[i], read.JointDelta[i], 1e-5, "delta " + i);
            }
        }

        [Test]
        public void WhatWasWrittenIsNotTakenForAMovement()
        {
            layers.SetExpression(avatar.Expressions[0].Name, 0.5f);
            layers.SetJoint(avatar.Skeleton.Names[1], 0.2, -0.3, 0.1);
            for (int i = 0; i < 3; i++) layers.Mix(pose, null, 0, rig, null);
            layers.ClearScript();
            for (int i = 0; i < 3; i++) layers.Mix(pose, null, 0, rig, null);
            AssertRest();
        }

        [Test]
        public void LaterSourcesWin()
        {
            var clip = new Core.Clip(avatar, 0);
            var alone = new Core.Pose(avatar);
            clip.Sample(0.5 * clip.Seconds, alone);
            layers.Mix(pose, clip, 0.5 * clip.Seconds, rig, null);
            Assert.AreEqual(alone.ExpressionWeights[2], pose.ExpressionWeights[2], 0, "clip");
            proxy.SetBlendShapeWeight(2, 33);
            layers.Mix(pose, clip, 0.5 * clip.Seconds, rig, null);
            Assert.AreEqual(0.33, pose.ExpressionWeights[2], 1e-6, "blend shape over clip");
            Assert.AreEqual(alone.ExpressionWeights[1], pose.ExpressionWeights[1], 0, "clip where no shape moved");
            layers.SetExpression(avatar.Expressions[2].Name, 0.9f);
            layers.SetExpression(avatar.Expressions[0].Name, 0.7f);
            layers.Mix(pose, clip, 0.5 * clip.Seconds, rig, null);
            Assert.AreEqual(0.9, pose.ExpressionWeights[2], 1e-6, "script over blend shape");
            var live = new GameObject("live").AddComponent<FixedFace>();
            layers.Mix(pose, clip, 0.5 * clip.Seconds, rig, live);
            var frame = new Core.DrivingFrame();
            var driven = new Core.Pose(avatar);
            live.Read(frame);
            new Core.Driver(avatar).Pose(frame, driven);
            Assert.AreNotEqual(alone.ExpressionWeights[0], driven.ExpressionWeights[0]);
            Assert.AreEqual(driven.ExpressionWeights[0], pose.ExpressionWeights[0], 0, "live input over all");
            Assert.AreEqual(0.9, pose.ExpressionWeights[2], 1e-6, "script where live input sets nothing");
            live.IsSeen = false;
            layers.Mix(pose, clip, 0.5 * clip.Seconds, rig, live);
            Assert.AreEqual(0.7, pose.ExpressionWeights[0], 1e-6, "no face: script again");
        }

        [Test]
        public void UnknownNamesAreErrors()
        {
            Assert.Throws<Core.AvatarError>(() => layers.SetExpression("no such thing", 1));
            Assert.Throws<Core.AvatarError>(() => layers.SetJoint("no such thing", 0, 0, 1));
        }

        private void AssertRest()
        {
            foreach (float weight in pose.ExpressionWeights) Assert.AreEqual(0, weight, 0);
            for (int i = 0; i < pose.JointDelta.Length; i++)
            {
                Assert.AreEqual(i % 16 % 5 == 0 ? 1 : 0, pose.JointDelta[i], 0);
            }
            for (int i = 0; i < 16; i++) Assert.AreEqual(i % 5 == 0 ? 1 : 0, pose.WorldFromAvatar[i], 0);
        }

        private static Matrix4x4 Local(Transform one)
        {
            Quaternion q = one.localRotation;
            Vector3 s = one.localScale, t = one.localPosition;
            return new Matrix4x4
            {
                m00 = (1 - 2 * (q.y * q.y + q.z * q.z)) * s.x, m01 = 2 * (q.x * q.y - q.w * q.z) * s.y,
                    m02 = 2 * (q.x * q.z + q.w * q.y) * s.z,
                m10 = 2 * (q.x * q.y + q.w * q.z) * s.x, m11 = (1 - 2 * (q.x * q.x + q.z * q.z)) * s.y,
                    m12 = 2 * (q.y * q.z - q.w * q.x) * s.z,
                m20 = 2 * (q.x * q.z - q.w * q.y) * s.x, m21 = 2 * (q.y * q.z + q.w * q.x) * s.y,
                    m22 = (1 - 2 * (q.x * q.x + q.y * q.y)) * s.z,
                m03 = t.x, m13 = t.y, m23 = t.z, m33 = 1,
            };
        }
    }

    /// <summary>A face that opens its jaw.</summary>
    public sealed class FixedFace : ArkitSource
    {
        /// <summary>The weight.</summary>
        public const float JawOpen = 0.25f;

        /// <summary>Whether there is a face.</summary>
        public bool IsSeen = true;

        /// <inheritdoc/>
        public override bool Read(Core.DrivingFrame into)
        {
            into.Weights[Array.IndexOf(Core.Arkit.Names, "jawOpen")] = JawOpen;
            return IsSeen;
        }
    }
}
