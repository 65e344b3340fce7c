using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using AvatarExport.Editor;
using NUnit.Framework;
using UnityEditor;
using UnityEditor.AssetImporters;
using UnityEngine;

namespace AvatarExport.Tests
{
    /// <summary>What the importer hands to Unity: here to a stub that keeps it, since Unity's own context cannot be made by tests.</summary>
    [TestFixture]
    public sealed class ImporterTests
    {
        private static AssetImportContext Import(byte[] file, string name = "face.avatar")
        {
            string folder = Path.Combine(Path.GetTempPath(), "avatar_" + Guid.NewGuid().ToString("N"));
            Directory.CreateDirectory(folder);
            try
            {
                string path = Path.Combine(folder, name);
                if (file != null) File.WriteAllBytes(path, file);
                var context = new AssetImportContext { assetPath = path };
                new AvatarImporter().OnImportAsset(context);
                return context;
            }
            finally
            {
                Directory.Delete(folder, true);
            }
        }

        private static void IsEmptyAndSaysSo(AssetImportContext context, string part)
        {
            Assert.AreEqual(1, context.Errors.Count);
            StringAssert.Contains("face.avatar: ", context.Errors[0]);
            StringAssert.Contains(part, context.Errors[0]);
            Assert.AreEqual(new[] { "asset", "prefab" }, context.Objects.Keys.ToArray());
            Assert.AreSame(context.Objects["prefab"], context.mainObject);
            var asset = (GaussianAvatarAsset)context.Objects["asset"];
            Assert.AreEqual(0, asset.Bytes.Length);
            Core.AvatarError error = Assert.Throws<Core.AvatarError>(() => asset.Load());
            Assert.AreEqual(context.Errors[0], error.Message);
            Assert.AreSame(asset, ((GameObject)context.mainObject).GetComponent<GaussianAvatar>().Asset);
        }

        [Test]
        public void AGoodFileIsAPrefab()
        {
            byte[] file = TestPacks.Head();
            AssetImportContext context = Import(file);
            Assert.AreEqual(0, context.Errors.Count);
            Assert.AreEqual(
                new[] { "asset", "prefab", "mesh", "icon", "clip held_out", "clip training" }, context.Objects.Keys.ToArray());
            var owner = (GameObject)context.mainObject;
            Assert.AreEqual("face", owner.name);
            Assert.AreEqual(AnimatorCullingMode.AlwaysAnimate, owner.GetComponent<Animator>().cullingMode);
            var component = owner.GetComponent<GaussianAvatar>();
            Assert.AreEqual(file, component.Asset.Bytes);
            Assert.AreEqual(12800, component.Asset.Load().Levels[0].Count);
            Assert.AreEqual(new[] { "root", "neck", "jaw", "leftEye", "rightEye" }, component.Bones.Select(bone => bone.name).ToArray());
            Assert.IsFalse(component.Proxy.enabled);
            Assert.AreSame(context.Objects["mesh"], component.Proxy.sharedMesh);
            Assert.AreEqual(53, component.Proxy.sharedMesh.blendShapeCount);
            Assert.AreEqual("browDownLeft", component.Proxy.sharedMesh.GetBlendShapeName(0));
            Assert.AreSame(context.Objects["icon"], context.Thumbnails["prefab"]);
            Assert.AreEqual(128, context.Thumbnails["prefab"].width);
        }

        [TestCase("head")]
        [TestCase("body")]
        [TestCase("joints")]
        public void CurvesNameWhatIsThere(string name)
        {
            byte[] file = name == "head" ? TestPacks.Head() : name == "body" ? TestPacks.Body() : TestPacks.Golden(name);
            AssetImportContext context = Import(file);
            Transform owner = ((GameObject)context.mainObject).transform;
            AnimationClip[] clips = context.Objects.Values.OfType<AnimationClip>().ToArray();
            Assert.Greater(clips.Length, 0);
            foreach (EditorCurveBinding curve in clips.SelectMany(AnimationUtility.GetCurveBindings))
            {
                Transform found = owner.Find(curve.path);
                Assert.IsNotNull(found, curve.path);
                Assert.IsNotNull(found.GetComponent(curve.type), curve.path + " has no " + curve.type.Name);
            }
        }

        [Test]
        public void AFileWithoutARigIsImported()
        {
            AssetImportContext context = Import(TestPacks.Golden("surface_without_rig"));
            Assert.AreEqual(0, context.Errors.Count);
            Assert.AreEqual(0, ((GameObject)context.mainObject).GetComponent<GaussianAvatar>().Bones.Count);
        }

        [Test]
        public void ACutFileIsAnErrorAndNoException()
        {
            byte[] file = TestPacks.Golden("joints");
            foreach (int length in new[] { 0, 1, 2, 18, 100, file.Length / 2, file.Length - 9, file.Length - 1 })
            {
                IsEmptyAndSaysSo(Import(file.Take(length).ToArray()), "");
            }
        }

        [Test]
        public void AFileThatCannotBeReadIsAnError()
        {
            Assert.AreEqual(1, Import(null).Errors.Count);
        }

        [TestCase("newer.avatar", "2.0")]
        [TestCase("index.avatar", "")]
        [TestCase("far.avatar", "float32")]
        [TestCase("huge.avatar", "")]
        public void OtherFilesAreRefusedByName(string name, string part)
        {
            IsEmptyAndSaysSo(Import(Cases.Bytes(name)), part);
        }

        [Test]
        public void DamagedBytesAreErrorsOrAvatars()
        {
            byte[] file = TestPacks.Golden("joints");
            var random = new System.Random(1);
            for (int trial = 0; trial < 8; trial++)
            {
                byte[] damaged = (byte[])file.Clone();
                for (int i = 0; i < 4; i++) damaged[random.Next(damaged.Length)] = (byte)random.Next(256);
                AssetImportContext context = Import(damaged);
                Assert.AreEqual(context.Errors.Count == 0, context.Objects.ContainsKey("mesh"), "trial " + trial);
            }
        }

        [Test]
        public void AnEyelidMayBeNamedAsAnExpression()
        {
            AssetImportContext context = Import(Cases.Bytes("clash.avatar"));
            Assert.AreEqual("", string.Join("; ", context.Errors.ToArray()));
            var mesh = (Mesh)context.Objects["mesh"];
            Core.Avatar avatar = ((GaussianAvatarAsset)context.Objects["asset"]).Load();
            Assert.AreEqual(avatar.LateMorphs[0], mesh.GetBlendShapeName(0));
            Assert.AreEqual(avatar.LateMorphs[0] + "_2", mesh.GetBlendShapeName(avatar.Expressions.Length));
        }

        [Test]
        public void ClipsOfOneNameAreToldApart()
        {
            AssetImportContext context = Import(Cases.Bytes("twins.avatar"));
            Assert.AreEqual(0, context.Errors.Count);
            string[] names = context.Objects.Values.OfType<AnimationClip>().Select(clip => clip.name).ToArray();
            Assert.AreEqual(new[] { "nod", "nod 2" }, names);
        }
    }
}
