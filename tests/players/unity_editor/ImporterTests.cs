using System;
using System.IO;
using System.Linq;
using AvatarExport.Core;
using AvatarExport.Editor;
using NUnit.Framework;
using UnityEditor;
using UnityEditor.AssetImporters;
using UnityEngine;

namespace AvatarExport.Tests {
    /// <summary>What the importer hands to Unity: here to a stub that keeps it, since Unity's own context cannot be made by tests.</summary>
    public sealed class ImporterTests {
        private static AssetImportContext Import(byte[] file, int errors = 0) {
            string folder = Path.Combine(Path.GetTempPath(), "avatar_" + Guid.NewGuid().ToString("N"));
            Directory.CreateDirectory(folder);
            try {
                var context = new AssetImportContext { assetPath = Path.Combine(folder, "face.avatar") };
                if (file != null) File.WriteAllBytes(context.assetPath, file);
                new AvatarImporter().OnImportAsset(context);
                if (errors >= 0) Assert.AreEqual(errors, context.Errors.Count, string.Join("; ", context.Errors.ToArray()));
                return context;
            } finally {
                Directory.Delete(folder, true);
            }
        }

        private static void IsEmptyAndSaysSo(byte[] file, string part = "") {
            AssetImportContext context = Import(file, 1);
            StringAssert.Contains("face.avatar: ", context.Errors[0]);
            StringAssert.Contains(part, context.Errors[0]);
            Assert.AreEqual(new[] { "asset", "prefab" }, context.Objects.Keys);
            Assert.AreSame(context.Objects["prefab"], context.mainObject);
            var asset = (GaussianAvatarAsset)context.Objects["asset"];
            Assert.AreEqual(0, asset.Bytes.Length);
            Assert.AreEqual(context.Errors[0], Assert.Throws<AvatarError>(() => asset.Load()).Message);
            Assert.AreSame(asset, ((GameObject)context.mainObject).GetComponent<GaussianAvatar>().Asset);
        }

        [Test]
        public void AGoodFileIsAPrefab() {
            byte[] file = TestPacks.Bytes("head");
            AssetImportContext context = Import(file);
            Assert.AreEqual(new[] { "asset", "prefab", "mesh", "icon", "clip held_out", "clip training" }, context.Objects.Keys);
            var owner = (GameObject)context.mainObject;
            Assert.AreEqual("face", owner.name);
            Assert.AreEqual(AnimatorCullingMode.AlwaysAnimate, owner.GetComponent<Animator>().cullingMode);
            var component = owner.GetComponent<GaussianAvatar>();
            Assert.AreEqual(file, component.Asset.Bytes);
            Assert.AreEqual(12800, component.Asset.Load().Levels[0].Count);
            Assert.AreEqual(new[] { "root", "neck", "jaw", "leftEye", "rightEye" }, component.Bones.Select(bone => bone.name));
            Assert.IsFalse(component.Proxy.enabled);
            Assert.AreSame(context.Objects["mesh"], component.Proxy.sharedMesh);
            Assert.AreEqual(53, component.Proxy.sharedMesh.blendShapeCount);
            Assert.AreEqual("browDownLeft", component.Proxy.sharedMesh.GetBlendShapeName(0));
            Assert.AreSame(context.Objects["icon"], context.Thumbnails["prefab"]);
            Assert.AreEqual(128, context.Thumbnails["prefab"].width);
        }

        [TestCase("head", 5)]
        [TestCase("body", 19)]
        [TestCase("joints", 5)]
        [TestCase("surface_without_rig", 0)]
        public void CurvesNameWhatIsThere(string name, int bones) {
            AssetImportContext context = Import(TestPacks.Bytes(name));
            Transform owner = ((GameObject)context.mainObject).transform;
            Assert.AreEqual(bones, owner.gameObject.GetComponent<GaussianAvatar>().Bones.Count);
            AnimationClip[] clips = context.Objects.Values.OfType<AnimationClip>().ToArray();
            Assert.IsTrue(clips.Length > 0 || bones == 0);
            foreach (EditorCurveBinding curve in clips.SelectMany(AnimationUtility.GetCurveBindings)) {
                Transform found = owner.Find(curve.path);
                Assert.IsNotNull(found, curve.path);
                Assert.IsNotNull(found.GetComponent(curve.type), curve.path + " has no " + curve.type.Name);
            }
        }

        [Test]
        public void ACutOrDamagedFileIsAnErrorAndNoException() {
            byte[] file = TestPacks.Bytes("joints");
            int[] lengths = { 0, 1, 2, 18, 100, file.Length / 2, file.Length - 9, file.Length - 1 };
            foreach (int length in lengths) IsEmptyAndSaysSo(file.Take(length).ToArray());
            Import(null, 1); // a file that cannot be read
            var random = new System.Random(1);
            for (int trial = 0; trial < 8; trial++) {
                byte[] damaged = (byte[])file.Clone();
                for (int i = 0; i < 4; i++) damaged[random.Next(damaged.Length)] = (byte)random.Next(256);
                AssetImportContext context = Import(damaged, -1);
                Assert.AreEqual(context.Errors.Count == 0, context.Objects.ContainsKey("mesh"), "trial " + trial);
            }
        }

        [TestCase("newer.avatar", "2.0")]
        [TestCase("index.avatar", "")]
        [TestCase("huge.avatar", "")]
        public void OtherFilesAreRefusedByName(string name, string part) => IsEmptyAndSaysSo(Cases.Bytes(name), part);

        [Test]
        public void AnEyelidMayBeNamedAsAnExpressionAndClipsOfOneNameAreToldApart() {
            AssetImportContext context = Import(Cases.Bytes("clash.avatar"));
            var mesh = (Mesh)context.Objects["mesh"];
            LoadedAvatar avatar = ((GaussianAvatarAsset)context.Objects["asset"]).Load();
            Assert.AreEqual(avatar.Eyelids[0], mesh.GetBlendShapeName(0));
            Assert.AreEqual(avatar.Eyelids[0] + "_2", mesh.GetBlendShapeName(avatar.Expressions.Length));
            context = Import(Cases.Bytes("twins.avatar"));
            Assert.AreEqual(new[] { "nod", "nod 2" }, context.Objects.Values.OfType<AnimationClip>().Select(clip => clip.name));
        }
    }
}
