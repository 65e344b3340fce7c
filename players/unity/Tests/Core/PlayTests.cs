using System;
using System.Collections.Generic;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>Instances, levels, lists of passes, scenes.</summary>
    public sealed class PlayTests {
        [Test]
        public void ALevelThatThereIsNotIsRefused() {
            LoadedAvatar avatar = Cases.Loaded("two_levels");
            var instance = new Instance(avatar, 1);
            Assert.AreSame(avatar.Program.Levels[1], instance.Program);
            foreach (int level in new[] { -1, 2 }) {
                Assert.AreEqual("level", Assert.Throws<AvatarError>(() => instance.Level = level).Field);
                Assert.Throws<AvatarError>(() => new Instance(avatar, level));
            }
            Assert.AreEqual(1, instance.Level);
        }

        [Test]
        public void LevelsOfTheVectorsAreChosen() {
            Json[] sequences = Cases.Read("height_px.json").At("sequences").List();
            for (int i = 0; i < sequences.Length; i++) {
                LevelInfo[] levels = LoadedAvatar.Load(Cases.Bytes("levels_" + i + ".avatar")).Levels;
                int level = (int)sequences[i].At("shown").Number(); // -1: none
                foreach (Json step in sequences[i].At("steps").List()) {
                    level = Levels.Next(levels, Height(step.List()[0]), level);
                    Assert.AreEqual(step.List()[1].Int(), level, sequences[i].At("name").Text());
                }
            }
        }

        [TestCase("right")]
        [TestCase("left")]
        public void HeightsAreThoseOfTheVectors(string hand) {
            var instance = new Instance(LoadedAvatar.Load(Cases.Bytes("height_" + hand + ".avatar"), hand), 0);
            var camera = new AvatarCamera();
            foreach (Json one in Cases.Read("height_px.json").At("heights").List()) {
                double[] pose = one.At("pose").Numbers(); // arrays of a pose are in the frame of the pack
                if (hand == "left") pose = pose.Select((m, i) => (i < 4) != (i % 4 == 0) ? -m : m).ToArray();
                one.At("place").Numbers().CopyTo(instance.Place, 0);
                pose.CopyTo(instance.Pose.WorldFromAvatar, 0);
                float[] clip = one.At("clip_from_world").Numbers().Select(m => (float)m).ToArray();
                int[] pixels = one.At("image_px").Numbers().Select(m => (int)m).ToArray();
                camera.SetMatrices(camera.CameraFromWorld, clip, new float[3], new[] { 1f, 1f }, pixels[0], pixels[1]);
                double want = Height(one.At("height_px")), found = instance.HeightPx(camera);
                Assert.IsTrue(found == want || Math.Abs(found / want - 1) < 1e-5, one.At("name").Text() + " " + found);
            }
        }

        private static double Height(Json said) => said.Value == null ? double.PositiveInfinity : said.Number();

        [Test]
        public void ValuesOfTheFrameAreNewOnce() {
            LoadedAvatar avatar = Cases.Loaded("joints");
            var instance = new Instance(avatar, 0);
            var camera = new AvatarCamera();
            instance.Update(camera);
            PassList deform = PassList.Of(avatar.Program, instance.Program.Deform, avatar.Groups.Length);
            PassList view = PassList.Of(avatar.Program, instance.Program.View, avatar.Groups.Length);
            Assert.IsTrue(deform.Set(instance.Values) && view.Set(instance.Values));
            Assert.IsFalse(deform.Set(instance.Values) || view.Set(instance.Values));
            camera.Orbit(new double[3], 2, 0, 0, 1, 64, 64);
            instance.UpdateCamera(camera);
            Assert.IsTrue(view.Set(instance.Values));
            Assert.IsFalse(deform.Set(instance.Values));
            instance.Pose.WorldFromAvatar[3] = 0.5;
            instance.UpdatePose();
            Assert.IsTrue(deform.Set(instance.Values));
            instance.Values.Floats[0] = float.NaN;
            Assert.IsTrue(deform.Set(instance.Values) && deform.Set(instance.Values), "NaN is always new");
        }

        [Test]
        public void ShThatNoExpressionChangesAreBlendedOnce() {
            int found = 0;
            foreach (string name in Cases.Packs()) {
                LoadedAvatar avatar = Cases.Loaded(name);
                Pass[] deform = avatar.Program.Levels[0].Deform;
                PassList list = PassList.Of(avatar.Program, deform, avatar.Groups.Length);
                Pass[] blends = deform.Where(one => one.Entry == "blend").ToArray();
                Pass[] lasting = blends.Where(one => one.Constants["appearance_sh_width"].Number == 0).ToArray();
                found += lasting.Length;
                Assert.AreEqual(lasting.Length > 0, list.KeepLasting(), name);
                Assert.IsFalse(list.KeepLasting(), name);
                foreach (Pass one in blends) {
                    Dispatch dispatch = list.Dispatches[Array.IndexOf(deform, one)];
                    ConstantSlot slot = dispatch.Constants.Single(constant => constant.Name == "sh_terms");
                    double terms = lasting.Contains(one) ? 0 : one.Constants["sh_terms"].Number;
                    Assert.AreEqual(terms, list.UInts[slot.First], name);
                }
            }
            Assert.Greater(found, 0);
            Assert.Less(found, Cases.Packs().Length);
        }

        [Test]
        public void ASingularPlaceDrawsNothing() {
            var instance = new Instance(Cases.Loaded("joints"), 0);
            Array.Clear(instance.Place, 0, 11);
            instance.Update(new AvatarCamera());
            int camera = instance.Values.Layout.First("camera_row0");
            Assert.AreEqual(new float[12], instance.Values.Floats.Skip(camera).Take(12));
        }

        [Test]
        public void ASceneHasItsBuffersAndItsLimit() {
            SceneSort empty = SceneSort.Of(new ProjectedChunk[0]);
            Assert.AreEqual(0, empty.Passes.Dispatches.Length);
            Assert.IsTrue(empty.Buffers.All(one => one.Count > 0));
            var chunks = new List<ProjectedChunk> {
                new ProjectedChunk { Buffer = "0/Projected.0", Count = 1000 },
                new ProjectedChunk { Buffer = "1/Projected.0", Count = 25 },
            };
            SceneSort two = SceneSort.Of(chunks);
            Assert.AreEqual(new[] { 1025, 2 + 24, 2 + 24 + 2 }, new[] { two.Count, two.SortDispatches, two.Passes.Dispatches.Length });
            Assert.AreEqual(new[] { 1025, 1025, 32, 3075 }, two.Buffers.Select(one => one.Count));
            Assert.IsFalse(two.Passes.Set(new FrameValues(1)));
            chunks.Add(new ProjectedChunk { Buffer = "2/Projected.0", Count = 65535 * 64 });
            AvatarError error = Assert.Throws<AvatarError>(() => SceneSort.Of(chunks));
            StringAssert.Contains("the scene: has 4195265 splats; one sort takes 4194240", error.Message);
        }
    }
}
