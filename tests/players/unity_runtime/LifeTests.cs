using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Reflection;
using System.Runtime.CompilerServices;
using AvatarExport.Core;
using NUnit.Framework;
using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport.Tests {
    /// <summary>Later frames, what is freed, and levels by the height on the screen.</summary>
    public sealed class LifeTests : Stage {
        private static readonly Quaternion Turned = new Quaternion(0.6f, 0, 0, 0.8f);

        [Test]
        public void ASecondFrameUploadsNothingThatStays() {
            GaussianAvatar avatar = Add(Packs.Joints);
            Frame();
            long before = GraphicsBuffer.uploads;
            CommandBuffer commands = Frame();
            Assert.AreEqual(before, GraphicsBuffer.uploads);
            Assert.IsFalse(Entries(commands).Contains("activate"), "an unchanged pose was deformed again");
            avatar.SetExpression(avatar.Avatar.Expressions[0].Name, 0.5f);
            commands = Frame();
            Assert.AreEqual(4L * avatar.Avatar.Program.PoseFloats, GraphicsBuffer.uploads - before);
            Assert.IsTrue(Entries(commands).Contains("activate"));
            Assert.AreEqual("project", Entries(Render(NewCamera()))[0], "a second camera uses the same deformation");
        }

        [Test]
        public void AFrameAllocatesNothing() {
            GaussianAvatar avatar = Add(Packs.Joints);
            avatar.Play(avatar.Avatar.Clips[0].Name);
            avatar.LiveInput = new GameObject("face").AddComponent<FixedFace>();
            avatar.SetExpression(avatar.Avatar.Expressions[2].Name, 0.4f);
            avatar.SetJoint(avatar.Avatar.Skeleton.Names[0], Turned);
            var late = (Action)Delegate.CreateDelegate(typeof(Action), avatar, "LateUpdate");
            int names = 0;
            long found = Allocated(() => {
                names = Shader.lookups;
                for (int i = 0; i < 100; i++) {
                    late();
                    Camera.onPreCull(Seen);
                    Camera.onPreRender(Seen);
                    Camera.onPostRender(Seen);
                }
            });
            Assert.AreEqual(0L, found, "bytes of 100 frames");
            Assert.AreEqual(names, Shader.lookups);
        }

        [Test]
        public void EverythingIsFreedWithTheLastAvatar() {
            GaussianAvatar one = Add(Packs.Joints), two = Add(Packs.WithoutRig);
            Frame();
            int all = GraphicsBuffer.Live.Count;
            Remove(one);
            Frame();
            Assert.IsTrue(GraphicsBuffer.Live.Count < all);
            Remove(two);
            Assert.AreEqual(0, GraphicsBuffer.Live.Count);
            Assert.IsNull(Render(Seen));
            one.Send("OnEnable");
            Assert.IsNotNull(Frame());
            UnityEngine.Object.Destroy(one.gameObject);
            Assert.AreEqual(0, GraphicsBuffer.Live.Count);
        }

        [Test]
        public void InstancesShareStaticBuffers() {
            GaussianAvatarAsset asset = Asset(Packs.Bytes(Packs.Joints));
            var counts = new List<int>();
            LoadedAvatar avatar = null;
            GaussianAvatar first = null;
            for (int i = 0; i < 3; i++) {
                GaussianAvatar one = Add(null);
                one.Asset = asset;
                Assert.IsTrue(i == 0 || ReferenceEquals(one.Avatar, avatar));
                avatar = one.Avatar;
                first = first ?? one;
                Frame();
                counts.Add(GraphicsBuffer.Live.Count);
            }
            Assert.IsTrue(counts[2] - counts[1] <= avatar.Program.Buffers.Values.Count(one => one.Sections.Length == 0));
            Remove(first);
            Assert.AreEqual(counts[1], GraphicsBuffer.Live.Count, "what the others use stays");
            End();
            Assert.AreEqual(0, GraphicsBuffer.Live.Count);
        }

        [Test]
        public void ADeviceWithoutComputeShowsTheMeshAndSaysSoOnce() {
            SystemInfo.compute = false;
            GaussianAvatar avatar = Add(Packs.Joints);
            Assert.IsFalse(avatar.Proxy.enabled);
            SaysOnce("no compute shaders");
            Assert.IsTrue(avatar.Proxy.enabled);
            Assert.AreEqual(ShadowCastingMode.On, avatar.Proxy.shadowCastingMode);
        }

        [Test]
        public void AShaderThatDoesNotRunShowsTheMeshAndSaysSoOnce() {
            ComputeShader.runs = false;
            FieldInfo known = typeof(Kernels).GetField("Known", BindingFlags.Static | BindingFlags.NonPublic);
            ((System.Collections.IDictionary)known.GetValue(null)).Clear(); // other tests have run them
            GaussianAvatar avatar = Add(Packs.Joints);
            SaysOnce("does not run with this graphics API");
            Assert.IsTrue(avatar.Proxy.enabled);
        }

        [Test]
        public void BuffersThatAreTooLargeAreToldOnce() {
            SystemInfo.most = 64;
            Add(Packs.WithoutRig);
            SaysOnce("this device's buffers hold 64");
            End();
            Assert.AreEqual(0, GraphicsBuffer.Live.Count, "what was made before the error is freed");
        }

        [TestCase(true)]
        [TestCase(false)]
        public void AMeshThatIsDrawnHasAMaterialOrSaysSo(bool found) {
            Shader.found = found;
            GaussianAvatar avatar = Add(Packs.Joints);
            UnityEngine.Object.Destroy(avatar.Proxy.sharedMaterial);
            avatar.ProxyUse = ProxyUse.Shadows;
            if (found) Assert.AreEqual("Legacy Shaders/Diffuse", avatar.Proxy.sharedMaterial.name);
            else StringAssert.Contains("set one on " + AvatarRig.ProxyPath, Debug.Told[0]);
            UnityEngine.Object.Destroy(avatar.Proxy.sharedMaterial); // the next one looks for it again
        }

        [Test]
        public void AFileThatIsNotSoundLeavesWhatIsShown() {
            GaussianAvatar avatar = Add(Packs.Joints);
            LoadedAvatar shown = avatar.Avatar;
            byte[] cut = Packs.Bytes(Packs.Joints);
            Array.Resize(ref cut, cut.Length / 2);
            Assert.Throws<AvatarError>(() => avatar.Load(cut, "cut"));
            Assert.AreSame(shown, avatar.Avatar);
            avatar.Asset = Asset(cut);
            Assert.IsNull(avatar.Avatar);
            Assert.AreEqual(1, Debug.Told.Count);
            StringAssert.Contains("cut", Debug.Told[0]);
        }

        [Test]
        public void ARigThatDoesNotFitIsMadeAnewOnceItIsDeleted() {
            LoadedAvatar first = Packs.Read(Packs.WithoutRig);
            SkinnedMeshRenderer proxy;
            var owner = new GameObject("saved");
            Transform[] bones = AvatarRig.Build(owner.transform, first, AvatarRig.MakeMesh(first), HideFlags.None, out proxy);
            GaussianAvatar saved = Add(null, owner);
            saved.Adopt(null, proxy, bones);
            saved.Asset = Asset(Packs.Bytes(Packs.Joints));
            StringAssert.Contains("delete the object Rig", Debug.Told[Debug.Told.Count - 1]);
            int told = Debug.Told.Count;
            Assert.IsNotNull(Frame(), "splats are shown without it");
            UnityEngine.Object.Destroy(proxy.transform.parent.gameObject);
            Assert.IsNotNull(Frame());
            Assert.AreEqual(told, Debug.Told.Count);
            Assert.AreEqual(saved.Avatar.Skeleton.Names.Length, saved.Bones.Count);
            saved.Proxy.SetBlendShapeWeight(0, 40);
            Frame();
            Assert.AreEqual(0.4, saved.Pose.ExpressionWeights[0], 1e-6);
            UnityEngine.Object.Destroy(saved.Proxy.transform.parent.gameObject);
            Application.playing = false;
            Render(Seen); // a picture may come before the next LateUpdate
            Application.playing = true;
            Frame();
            Assert.IsFalse(saved.Proxy == null, "its own rig, too");
            saved.Asset = null;
            Frame();
            Assert.IsNull(saved.Avatar);
        }

        [Test]
        public void DeletedObjectsOfTheRigAreToldOrMadeAgain() {
            GaussianAvatar avatar = Add(Packs.Joints);
            Frame();
            UnityEngine.Object.Destroy(avatar.Bones[1]);
            for (int i = 0; i < 3; i++) Assert.IsNotNull(Frame());
            StringAssert.Contains("delete the object " + AvatarRig.RootName, Debug.Told[0]);
            Transform root = avatar.Proxy.transform.parent;
            UnityEngine.Object.Destroy(avatar.Proxy);
            UnityEngine.Object.Destroy(root);
            Frame();
            avatar.Proxy.SetBlendShapeWeight(0, 40);
            Frame();
            Assert.AreEqual(0.4, avatar.Pose.ExpressionWeights[0], 1e-6);
            Assert.AreEqual(1, Debug.Told.Count);
        }

        [Test]
        public void HiddenAndUnseenAvatarsCostNothing() {
            GaussianAvatar avatar = Add(Packs.Joints);
            Action<Action<bool>> hides = set => {
                set(true);
                Assert.IsNull(Frame());
                set(false);
            };
            hides(on => avatar.Visible = !on);
            hides(on => Seen.cullingMask = on ? 0 : ~0);
            hides(on => Seen.orthographic = on);
            hides(on => GeometryUtility.seen = !on);
            Assert.IsNotNull(Frame());
            Seen.stereoEnabled = GeometryUtility.onlyLast = true; // what the right eye alone sees
            for (int eye = 0; eye < 2; eye++) Seen.stereoViews[eye] = Seen.worldToCameraMatrix;
            Assert.IsNotNull(Frame());
        }

        [Test]
        public void SplatsFollowTheSkinnedMeshWhereAsked() {
            GaussianAvatar avatar = Add(Packs.Surface);
            avatar.FollowProxy = true;
            List<string> entries = Entries(Frame());
            Assert.IsFalse(entries.Contains("morph") || entries.Contains("skin"));
            Assert.IsTrue(entries.Contains("activate"));
            avatar.FollowProxy = false;
            Assert.IsTrue(Entries(Frame()).Contains("morph"));
        }

        [Test]
        public void WhileASceneIsEditedEachPictureShowsThePoseOfNow() {
            GaussianAvatar avatar = Add(Packs.Joints);
            Application.playing = false;
            Frame();
            avatar.Proxy.SetBlendShapeWeight(0, 40);
            avatar.Bones[1].localRotation = Turned;
            Assert.IsTrue(Entries(Render(Seen)).Contains("activate"));
            Assert.AreEqual(0.4, avatar.Pose.ExpressionWeights[0], 1e-6);
            avatar.SetExpression(avatar.Avatar.Expressions[1].Name, 1);
            int writes = avatar.Proxy.writes;
            Frame();
            Assert.AreEqual(writes, avatar.Proxy.writes, "what is written now would be saved with the scene");
            avatar.ResetPose();
            Assert.AreEqual(0, avatar.Proxy.GetBlendShapeWeight(0), 0);
            Assert.AreNotEqual(0.6f, avatar.Bones[1].localRotation.x);
            Frame();
            Assert.AreEqual(new float[avatar.Avatar.Expressions.Length], avatar.Pose.ExpressionWeights);
        }

        [Test]
        public void AWeightThatTheProjectClampsIsNotTakenForAMovement() {
            GaussianAvatar avatar = Add(Packs.Joints);
            avatar.Proxy.clamps = true;
            string name = avatar.Avatar.Expressions[0].Name;
            avatar.SetExpression(name, 1.5f);
            for (int i = 0; i < 2; i++) Frame();
            avatar.ClearExpression(name);
            Frame();
            Assert.AreEqual(0, avatar.Pose.ExpressionWeights[0], 0);
        }

        [Test]
        public void WhatScriptsSetBeforeTheFirstFrameStays() {
            GaussianAvatar avatar = Add(Packs.Joints);
            avatar.Send("OnValidate"); // the Editor calls it while it makes an object, before OnEnable
            avatar.Load(Packs.Bytes(Packs.Joints), Packs.Joints);
            avatar.SetJoint(avatar.Avatar.Skeleton.Names[1], Turned);
            Frame();
            Assert.AreNotEqual(1, avatar.Pose.JointDelta[16 + 5]);
        }

        [TestCase("right")]
        [TestCase("left")]
        public void LevelsAndBoxesAndTurnsFollowTheFramingInUnitysFrame(string hand) {
            const float Tall = 0.242f, Border = 60; // of the pack: metres of its framing, pixels of level 1
            GaussianAvatar avatar = Add(null);
            avatar.Load(Mole(hand), hand);
            FieldInfo instance = avatar.GetType().GetField("instance", BindingFlags.Instance | BindingFlags.NonPublic);
            avatar.Level = 99; // more than there are: the coarsest
            Assert.IsNotNull(Frame());
            var found = new List<int> { ((Instance)instance.GetValue(avatar)).Level };
            avatar.Level = -1;
            foreach (float share in new[] { 1.2f, 0.95f, 0.8f, 1.05f, 1.2f, 0.5f }) {
                Matrix4x4 view = Seen.worldToCameraMatrix;
                view.m23 = -Seen.projectionMatrix.m11 * Tall * Height / 2 / (share * Border);
                Seen.worldToCameraMatrix = view;
                for (int i = 0; i < 2; i++) Assert.IsNotNull(Frame()); // the next frame shows the level of this one
                found.Add(((Instance)instance.GetValue(avatar)).Level);
            }
            Assert.AreEqual(new[] { 1, 0, 0, 1, 1, 0, 1 }, found);
            Assert.AreEqual(-0.05f, avatar.WorldBounds.center.x, 0.02f); // it stands 5 cm to the person's left
            avatar.SetJoint("neck", new Quaternion(0, 0.28f, 0, 0.96f));
            Frame();
            double wanted = 2 * 0.28 * 0.96; // x of what was z, by the quaternion alone
            Assert.AreEqual(hand == "left" ? wanted : -wanted, avatar.Pose.JointDelta[16 + 2], 1e-6);
        }

        private static byte[] Mole(string hand, [CallerFilePath] string here = "") {
            string[] path = { Path.GetDirectoryName(here), "..", "..", "data", "mole", hand + ".avatar" };
            return File.ReadAllBytes(Path.Combine(path));
        }
    }
}
