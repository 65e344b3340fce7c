using System;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>Cameras as Python makes them, and as engines do.</summary>
    public sealed class CameraTests {
        private static readonly double[] Still = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };

        [Test]
        public void OrbitAndFromOpencvAreThoseOfPython() {
            Json[] cases = Cases.Read("cameras.json").List(40);
            var camera = new AvatarCamera();
            foreach (Json said in cases) {
                Json[] given = said.At("given").List();
                int width = given[given.Length - 2].Int(), height = given[given.Length - 1].Int();
                if (said.At("how").Text() == "orbit") {
                    double[] n = given.Skip(1).Select(one => one.Number()).ToArray();
                    camera.Orbit(given[0].Vector(), n[0], n[1], n[2], n[3], width, height);
                } else {
                    camera.FromOpencv(given[0].Numbers(), given[1].Numbers(), given[2].Numbers(), width, height);
                }
                string[] names = { "cameraFromWorld", "clipFromWorld", "centre", "tanHalfFov" };
                Close(camera, names.Select(name => said.At(name).Numbers()).ToArray(), width, height, 2);
            }
        }

        private static float[][] Parts(AvatarCamera of) {
            return new[] { of.CameraFromWorld, of.ClipFromWorld, of.Centre, of.TanHalfFov };
        }

        private static void Close(AvatarCamera got, double[][] want, int width, int height, double roundings) {
            for (int i = 0; i < want.Length; i++) Near.Round(Parts(got)[i], want[i], roundings, "camera");
            Assert.AreEqual(new[] { width, height }, new[] { got.Width, got.Height });
        }

        private static void Close(AvatarCamera got, AvatarCamera want, double roundings) {
            Close(got, Parts(want).Select(Doubles).ToArray(), want.Width, want.Height, roundings);
        }

        private static double[] Doubles(float[] values) => values.Select(one => (double)one).ToArray();

        /// <summary>The camera that OpenGL's matrices describe: looking along -z, y up, row-major.</summary>
        [Test]
        public void ACameraOfAnEngineSeesWhatOrbitSees() {
            AvatarCamera orbit = new AvatarCamera(), engine = new AvatarCamera(), same = new AvatarCamera();
            orbit.Orbit(new[] { 0.1, 0.2, 0.3 }, 2, 0.3, 0.2, Math.PI / 6, 200, 100);
            double[] view = Doubles(orbit.CameraFromWorld);
            for (int i = 4; i < 12; i++) view[i] = -view[i]; // y up, z backwards
            double along = 1 / Math.Tan(Math.PI / 12);
            double[] projection = { along / 2, 0, 0, 0, 0, along, 0, 0, 0, 0, -1.2, -0.4, 0, 0, -1, 0 };
            engine.FromOpengl(view, projection, 200, 100);
            Close(engine, orbit, 8);
            same.Copy(engine);
            Close(same, engine, 0);
            for (int i = 8; i < 12; i++) view[i] = -view[i]; // one that looks along +z
            projection[14] = 1;
            same.FromOpengl(view, projection, 200, 100);
            Close(same, engine, 0);
        }

        [Test]
        public void AnOffCentreProjectionIsTaken() {
            var camera = new AvatarCamera();
            camera.FromOpengl(Still, new[] { 2, 0, 0.25, 0, 0, 3, -0.5, 0, 0, 0, -1, -0.1, 0, 0, -1, 0 }, 64, 64);
            double[] p = { 0.3, -0.2, -2, 1 }; // clip of the engine: x 0.1, y 0.4, w 2; ours has y down
            var clip = new[] { 0, 1, 3 }.Select(row => Enumerable.Range(0, 4).Sum(i => camera.ClipFromWorld[4 * row + i] * p[i]));
            Near.Check(clip, new[] { 0.1, -0.4, 2 }, 1e-6, "clip");
        }

        [Test]
        public void WhatIsNoPerspectiveCameraIsRefused() {
            var camera = new AvatarCamera();
            AvatarError error = Assert.Throws<AvatarError>(() => camera.FromOpengl(Still, Still, 64, 64));
            StringAssert.Contains("orthographic", error.Message);
            error = Assert.Throws<AvatarError>(() => camera.Orbit(new double[3], 1, 0, 0, 1, 0, 64));
            StringAssert.Contains("0x64", error.Message);
        }
    }
}
