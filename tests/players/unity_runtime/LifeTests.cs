using System;
using System.Collections.Generic;
using System.Reflection;
using NUnit.Framework;
using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport.Tests
{
    /// <summary>Later frames, and what is freed.</summary>
    public sealed class LifeTests
    {
        private const int Frames = 100;

        private Stage stage;

        [SetUp]
        public void Begin()
        {
            stage = new Stage();
        }

        [Test]
        public void ASecondFrameUploadsNothingThatStays()
        {
            GaussianAvatar avatar = stage.Add(Packs.Joints);
            stage.Frame();
            long before = GraphicsBuffer.uploads;
            CommandBuffer commands = stage.Frame();
            Assert.AreEqual(before, GraphicsBuffer.uploads);
            Assert.IsFalse(Stage.Entries(commands).Contains("activate"), "an unchanged pose was deformed again");
            avatar.SetExpression(avatar.Avatar.Expressions[0].Name, 0.5f);
            commands = stage.Frame();
            Assert.AreEqual(4L * avatar.Avatar.Program.PoseFloats, GraphicsBuffer.uploads - before);
            Assert.IsTrue(Stage.Entries(commands).Contains("activate"));
            stage.End();
        }

        [Test]
        public void AFrameAllocatesNothing()
        {
            GaussianAvatar avatar = stage.Add(Packs.Joints);
            avatar.Play(avatar.Avatar.Clips[0].Name);
            avatar.LiveInput = new GameObject("face").AddComponent<FixedFace>();
            avatar.SetExpression(avatar.Avatar.Expressions[2].Name, 0.4f);
            avatar.SetJoint(avatar.Avatar.Skeleton.Names[0], new Quaternion(0.6f, 0, 0, 0.8f));
            Action late = (Action)Delegate.CreateDelegate(typeof(Action), avatar, "LateUpdate");
            Camera camera = stage.Camera;
            for (int i = 0; i < 20; i++) Frame(late, camera);
            int names = Shader.lookups;
            var allocated =
                (Func<long>)Delegate.CreateDelegate(typeof(Func<long>), typeof(GC),
                "GetAllocatedBytesForCurrentThread");
            allocated();
            long before = allocated();
            for (int i = 0; i < Frames; i++) Frame(late, camera);
            long found = allocated() - before;
            Assert.AreEqual(0L, found, "bytes of " + Frames + " frames");
            Assert.AreEqual(names, Shader.lookups);
            stage.End();
        }

        [Test]
        public void EverythingIsFreedWithTheLastAvatar()
        {
            GaussianAvatar one = stage.Add(Packs.Joints), two = stage.Add(Packs.WithoutRig);
            stage.Frame();
            int all = GraphicsBuffer.Live.Count;
            one.Send("OnDisable");
            stage.Avatars.Remove(one);
            stage.Frame();
            Assert.IsTrue(GraphicsBuffer.Live.Count < all);
            two.Send("OnDisable");
            Assert.AreEqual(0, GraphicsBuffer.Live.Count);
            Assert.IsNull(Stage.Render(stage.Camera));
            one.Send("OnEnable");
            stage.Avatars.Add(one);
            Assert.IsNotNull(stage.Frame());
            stage.End();
            Assert.AreEqual(0, GraphicsBuffer.Live.Count);
        }

        [Test]
        public void TwoInstancesShareStaticBuffers()
        {
            GaussianAvatarAsset asset = new GaussianAvatarAsset { name = "shared", Bytes = Packs.Bytes(Packs.Joints) };
            var counts = new List<int>();
            for (int i = 0; i < 3; i++)
            {
                GaussianAvatar one = new GameObject("one").AddComponent<GaussianAvatar>();
                one.Asset = asset;
                stage.Avatars.Add(one);
                stage.Frame();
                counts.Add(GraphicsBuffer.Live.Count);
            }
            Assert.AreSame(stage.Avatars[0].Avatar, stage.Avatars[1].Avatar);
            int fixedBuffers = 0;
            foreach (Core.Buffer one in stage.Avatars[0].Avatar.Program.Buffers.Values)
            {
                fixedBuffers += one.Sections.Length > 0 ? 1 : 0;
            }
            Assert.IsTrue(counts[2] - counts[1] <= stage.Avatars[0].Avatar.Program.Buffers.Count - fixedBuffers);
            stage.End();
            Assert.AreEqual(0, GraphicsBuffer.Live.Count);
        }

        [Test]
        public void ADeviceWithoutComputeShowsTheMeshAndSaysSoOnce()
        {
            SystemInfo.compute = false;
            GaussianAvatar avatar = stage.Add(Packs.Joints);
            Assert.IsFalse(avatar.Proxy.enabled);
            for (int i = 0; i < 3; i++) Assert.IsNull(stage.Frame());
            Assert.IsTrue(avatar.Proxy.enabled);
            Assert.AreEqual(ShadowCastingMode.On, avatar.Proxy.shadowCastingMode);
            Assert.AreEqual(1, Debug.Told.Count);
            StringAssert.Contains("no compute shaders", Debug.Told[0]);
            stage.End();
        }

        [TestCase(true)]
        [TestCase(false)]
        public void AMeshThatIsDrawnHasAMaterialOrSaysSo(bool found)
        {
            Shader.found = found;
            try
            {
                GaussianAvatar avatar = stage.Add(Packs.Joints);
                UnityEngine.Object.Destroy(avatar.Proxy.sharedMaterial);
                avatar.ProxyUse = ProxyUse.Shadows;
                if (found) Assert.AreEqual("Legacy Shaders/Diffuse", avatar.Proxy.sharedMaterial.name);
                else StringAssert.Contains("set one on " + AvatarRig.ProxyPath, Debug.Told[0]);
                UnityEngine.Object.Destroy(avatar.Proxy.sharedMaterial); // the next one looks for it again
                stage.End();
            }
            finally
            {
                Shader.found = true;
            }
        }

        [Test]
        public void AShaderThatDoesNotRunShowsTheMeshAndSaysSoOnce()
        {
            ComputeShader.runs = false;
            var known = (System.Collections.IDictionary)typeof(Kernels).GetField(
                "Known", System.Reflection.BindingFlags.Static | System.Reflection.BindingFlags.NonPublic).GetValue(null);
            known.Clear(); // other tests have run them
            try
            {
                GaussianAvatar avatar = stage.Add(Packs.Joints);
                for (int i = 0; i < 3; i++) Assert.IsNull(stage.Frame());
                Assert.IsTrue(avatar.Proxy.enabled);
                Assert.AreEqual(1, Debug.Told.Count);
                StringAssert.Contains("does not run with this graphics API", Debug.Told[0]);
                stage.End();
            }
            finally
            {
                ComputeShader.runs = true;
            }
        }

        [Test]
        public void BuffersThatAreTooLargeAreToldOnce()
        {
            SystemInfo.most = 64;
            try
            {
                stage.Add(Packs.WithoutRig);
                for (int i = 0; i < 3; i++) Assert.IsNull(stage.Frame());
                Assert.AreEqual(1, Debug.Told.Count);
                StringAssert.Contains("this device's buffers hold 64", Debug.Told[0]);
                stage.End();
                Assert.AreEqual(0, GraphicsBuffer.Live.Count, "what was made before the error is freed");
            }
            finally
            {
                SystemInfo.most = 1L << 31;
            }
        }

        [Test]
        public void AFileThatIsNotSoundLeavesWhatIsShown()
        {
            GaussianAvatar avatar = stage.Add(Packs.Joints);
            Core.Avatar shown = avatar.Avatar;
            byte[] cut = Packs.Bytes(Packs.Joints);
            Array.Resize(ref cut, cut.Length / 2);
            Assert.Throws<Core.AvatarError>(() => avatar.Load(cut, "cut"));
            Assert.AreSame(shown, avatar.Avatar);
            avatar.Asset = new GaussianAvatarAsset { name = "cut", Bytes = cut };
            Assert.IsNull(avatar.Avatar);
            Assert.AreEqual(1, Debug.Told.Count);
            StringAssert.Contains("cut", Debug.Told[0]);
            stage.End();
        }

        [Test]
        public void ARigThatDoesNotFitIsMadeAnewOnceItIsDeleted()
        {
            GaussianAvatar avatar = stage.Add(Packs.WithoutRig);
            Core.Avatar first = avatar.Avatar;
            SkinnedMeshRenderer proxy;
            var owner = new GameObject("saved");
            Transform[] bones = AvatarRig.Build(owner.transform, first, AvatarRig.MakeMesh(first), HideFlags.None, out proxy);
            GaussianAvatar saved = owner.AddComponent<GaussianAvatar>();
            saved.Adopt(null, proxy, bones);
            stage.Avatars.Add(saved);
            saved.Asset = new GaussianAvatarAsset { name = "joints", Bytes = Packs.Bytes(Packs.Joints) };
            StringAssert.Contains("delete the object Rig", Debug.Told[Debug.Told.Count - 1]);
            int told = Debug.Told.Count;
            Assert.IsNotNull(stage.Frame(), "splats are shown without it");
            UnityEngine.Object.Destroy(proxy.transform.parent.gameObject);
            Assert.IsNotNull(stage.Frame());
            Assert.AreEqual(told, Debug.Told.Count);
            Assert.AreEqual(saved.Avatar.Skeleton.Names.Length, saved.Bones.Count);
            saved.Proxy.SetBlendShapeWeight(0, 40);
            stage.Frame();
            Assert.AreEqual(0.4, saved.Pose.ExpressionWeights[0], 1e-6);
            UnityEngine.Object.Destroy(saved.Proxy.transform.parent.gameObject);
            Application.playing = false;
            try
            {
                Stage.Render(stage.Camera); // a picture may come before the next LateUpdate
            }
            finally
            {
                Application.playing = true;
            }
            stage.Frame();
            Assert.IsFalse(saved.Proxy == null, "its own rig, too");
            saved.Asset = null;
            stage.Frame();
            Assert.IsNull(saved.Avatar);
            stage.End();
        }

        [Test]
        public void HiddenAndUnseenAvatarsCostNothing()
        {
            GaussianAvatar avatar = stage.Add(Packs.Joints);
            avatar.Visible = false;
            Assert.IsNull(stage.Frame());
            avatar.Visible = true;
            stage.Camera.cullingMask = 0;
            Assert.IsNull(stage.Frame());
            stage.Camera.cullingMask = ~0;
            stage.Camera.orthographic = true;
            Assert.IsNull(stage.Frame());
            stage.Camera.orthographic = false;
            GeometryUtility.seen = false;
            Assert.IsNull(stage.Frame());
            GeometryUtility.seen = true;
            Assert.IsNotNull(stage.Frame());
            stage.End();
        }

        [Test]
        public void AnAvatarThatTheRightEyeAloneSeesIsDrawn()
        {
            stage.Add(Packs.Joints);
            stage.Camera.stereoEnabled = GeometryUtility.onlyLast = true;
            for (int eye = 0; eye < 2; eye++) stage.Camera.stereoViews[eye] = stage.Camera.worldToCameraMatrix;
            Assert.IsNotNull(stage.Frame());
            GeometryUtility.onlyLast = false;
            stage.End();
        }

        [Test]
        public void SplatsFollowTheSkinnedMeshWhereAsked()
        {
            GaussianAvatar avatar = stage.Add(Packs.Surface);
            avatar.FollowProxy = true;
            CommandBuffer commands = stage.Frame();
            List<string> entries = Stage.Entries(commands);
            Assert.IsFalse(entries.Contains("morph") || entries.Contains("skin"));
            Assert.IsTrue(entries.Contains("activate"));
            avatar.FollowProxy = false;
            Assert.IsTrue(Stage.Entries(stage.Frame()).Contains("morph"));
            stage.End();
        }

        [Test]
        public void WhileASceneIsEditedEachPictureShowsThePoseOfNow()
        {
            GaussianAvatar avatar = stage.Add(Packs.Joints);
            Application.playing = false;
            try
            {
                stage.Frame();
                avatar.Proxy.SetBlendShapeWeight(0, 40);
                Assert.IsTrue(Stage.Entries(Stage.Render(stage.Camera)).Contains("activate"));
                Assert.AreEqual(0.4, avatar.Pose.ExpressionWeights[0], 1e-6);
                avatar.SetExpression(avatar.Avatar.Expressions[1].Name, 1);
                int writes = avatar.Proxy.writes;
                stage.Frame();
                Assert.AreEqual(writes, avatar.Proxy.writes, "what is written now would be saved with the scene");
            }
            finally
            {
                Application.playing = true;
            }
            stage.End();
        }

        [Test]
        public void ResetPutsTheBlendShapesOfAnEditedSceneToRest()
        {
            GaussianAvatar avatar = stage.Add(Packs.Joints);
            Application.playing = false;
            try
            {
                avatar.Proxy.SetBlendShapeWeight(0, 40);
                avatar.Bones[1].localRotation = new Quaternion(0.6f, 0, 0, 0.8f);
                stage.Frame();
                avatar.ResetPose();
                Assert.AreEqual(0, avatar.Proxy.GetBlendShapeWeight(0), 0);
                Assert.AreNotEqual(0.6f, avatar.Bones[1].localRotation.x);
                stage.Frame();
                Assert.AreEqual(0, avatar.Pose.ExpressionWeights[0], 0);
            }
            finally
            {
                Application.playing = true;
            }
            stage.End();
        }

        [Test]
        public void AWeightThatTheProjectClampsIsNotTakenForAMovement()
        {
            GaussianAvatar avatar = stage.Add(Packs.Joints);
            avatar.Proxy.clamps = true;
            string name = avatar.Avatar.Expressions[0].Name;
            avatar.SetExpression(name, 1.5f);
            for (int i = 0; i < 2; i++) stage.Frame();
            avatar.ClearExpression(name);
            stage.Frame();
            Assert.AreEqual(0, avatar.Pose.ExpressionWeights[0], 0);
            stage.End();
        }

        [Test]
        public void DeletedObjectsOfTheRigAreToldOrMadeAgain()
        {
            GaussianAvatar avatar = stage.Add(Packs.Joints);
            stage.Frame();
            UnityEngine.Object.Destroy(avatar.Bones[1]);
            for (int i = 0; i < 3; i++) Assert.IsNotNull(stage.Frame());
            Assert.AreEqual(1, Debug.Told.Count);
            StringAssert.Contains("delete the object " + AvatarRig.RootName, Debug.Told[0]);
            Transform root = avatar.Proxy.transform.parent;
            UnityEngine.Object.Destroy(avatar.Proxy);
            UnityEngine.Object.Destroy(root);
            stage.Frame();
            avatar.Proxy.SetBlendShapeWeight(0, 40);
            stage.Frame();
            Assert.AreEqual(0.4, avatar.Pose.ExpressionWeights[0], 1e-6);
            Assert.AreEqual(1, Debug.Told.Count);
            stage.End();
        }

        [Test]
        public void WhatScriptsSetBeforeTheFirstFrameStays()
        {
            GaussianAvatar avatar = stage.Add(Packs.Joints);
            avatar.Send("OnValidate"); // the Editor calls it while it makes an object, before OnEnable
            avatar.Load(Packs.Bytes(Packs.Joints), Packs.Joints);
            avatar.SetJoint(avatar.Avatar.Skeleton.Names[1], new Quaternion(0.6f, 0, 0, 0.8f));
            stage.Frame();
            Assert.AreNotEqual(1, avatar.Pose.JointDelta[16 + 5]);
            stage.End();
        }

        private static void Frame(Action late, Camera camera)
        {
            late();
            Camera.onPreCull(camera);
            Camera.onPreRender(camera);
            Camera.onPostRender(camera);
        }
    }
}
