using System;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>The numbers of a light, and lights that are refused.</summary>
    public sealed class LightTests {
        [TestCase("right")]
        [TestCase("left")]
        public void NumbersAreThoseOfPython(string hand) {
            Instance instance = Opened("light_" + hand);
            int first = instance.Values.Layout.First("light_ambient0");
            foreach (Json one in Cases.Read("lights.json").List()) {
                double[] pose = one.At("pose").Numbers(); // arrays of a pose are in the frame of the pack
                if (hand == "left") pose = pose.Select((m, i) => (i < 4) != (i % 4 == 0) ? -m : m).ToArray();
                one.At("place").Numbers().CopyTo(instance.Place, 0);
                pose.CopyTo(instance.Pose.WorldFromAvatar, 0);
                double[] head = one.At("head").Numbers();
                instance.Pose.SetJoint("neck", head[0], head[1], head[2]);
                instance.Light = Read(one);
                instance.UpdatePose();
                double[][] rows = one.At("rows").At(hand).List().Select(row => row.Numbers()).ToArray();
                Assert.AreEqual(rows[24][2] > 0, instance.CastsShadow);
                for (int i = 0; i < LightRows.Count; i++) {
                    double limit = 1e-5 * Math.Max(1, rows[i / 4].Max(number => Math.Abs(number)));
                    Assert.AreEqual(rows[i / 4][i % 4], instance.Values.Floats[first + i], limit, "number " + i);
                }
            }
        }

        [Test]
        public void ListsOfPassesTakeThem() {
            Instance instance = Opened("light_right");
            LoadedAvatar avatar = instance.Avatar;
            instance.Light = Read(Cases.Read("lights.json").List()[1]);
            instance.UpdatePose();
            Assert.IsTrue(instance.CastsShadow);
            foreach (Pass[] passes in new[] { instance.Program.Shadow, instance.Program.Light }) {
                PassList list = PassList.Of(avatar.Program, passes, avatar.Groups.Length);
                Assert.IsTrue(list.Set(instance.Values) && !list.Set(instance.Values));
            }
        }

        [Test]
        public void LightsAreRefused() {
            Instance instance = Opened("light_right");
            Json good = Cases.Read("lights.json").List()[1];
            Refused(instance, good, "more than 4 lights", light => light.Count = 5);
            Refused(instance, good, "ambient", light => light.Ambient[26] = double.NaN);
            Refused(instance, good, "place", light => light.Lights[0].Place[1] = double.PositiveInfinity);
            Refused(instance, good, "colour", light => light.Lights[0].Colour[1] = -1);
            Refused(instance, good, "no length", light => Array.Clear(light.Lights[0].Place, 0, 3));
            var plain = new Instance(Cases.Loaded("joints"), 0);
            AvatarError error = Assert.Throws<AvatarError>(() => plain.Light = Read(good));
            StringAssert.Contains("light: its colours hold an unknown light; make it with `pack --relight`", error.Message);
        }

        private static void Refused(Instance instance, Json good, string line, Action<SceneLight> change) {
            SceneLight light = Read(good);
            light.Lights[0].IsPoint = false;
            change(light);
            instance.Light = light;
            StringAssert.Contains(line, Assert.Throws<AvatarError>(instance.UpdatePose).Message);
        }

        private static Instance Opened(string name) => new Instance(LoadedAvatar.Load(Cases.Bytes(name + ".avatar"), name), 0);

        private static SceneLight Read(Json said) {
            Json[] lights = said.At("lights").List();
            var light = new SceneLight { Count = lights.Length, Shadow = said.At("shadow").Flag() };
            said.At("ambient").List().SelectMany(row => row.Numbers()).ToArray().CopyTo(light.Ambient, 0);
            for (int i = 0; i < lights.Length; i++) {
                Json[] parts = lights[i].List();
                parts[0].Numbers().CopyTo(light.Lights[i].Place, 0);
                parts[1].Numbers().CopyTo(light.Lights[i].Colour, 0);
                light.Lights[i].IsPoint = parts[2].Flag();
            }
            return light;
        }
    }
}
