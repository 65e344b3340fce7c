using System;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests
{
    /// <summary>Cameras as Python makes them, and as engines do.</summary>
    [TestFixture]
    public sealed class CameraTests
    {
        [Test]
        public void OrbitAndFromOpencvAreThoseOfPython()
        {
            Json[] cases = Cases.Read("cameras.json").List();
            Assert.GreaterOrEqual(cases.Length, 40);
            var camera = new Core.Camera();
            foreach (Json said in cases)
            {
                Json[] given = said.At("given").List();
                int width = given[given.Length - 2].Int(), height = given[given.Length - 1].Int();
                if (said.At("how").Text() == "orbit")
                {
                    double[] n = given.Skip(1).Select(one => one.Number()).ToArray();
                    camera.Orbit(given[0].Vector(), n[0], n[1], n[2], n[3], width, height);
                }
                else
                {
                    camera.FromOpencv(Numbers(given[0]), Numbers(given[1]), Numbers(given[2]), width, height);
                }
                Close(camera.CameraFromWorld, Numbers(said.At("cameraFromWorld")), 2);
                Close(camera.ClipFromWorld, Numbers(said.At("clipFromWorld")), 2);
                Close(camera.Centre, Numbers(said.At("centre")), 2);
                Close(camera.TanHalfFov, Numbers(said.At("tanHalfFov")), 2);
                Assert.AreEqual(new[] { width, height }, new[] { camera.Width, camera.Height });
            }
        }

        private static double[] Numbers(Json said)
        {
            return said.List().Select(one => one.Number()).ToArray();
        }

        private static void Close(float[] got, double[] want, double roundings)
        {
            Near.Check(got, want, roundings * Cases.Rounding * Near.Largest(want), "camera");
        }

        private static void Close(Core.Camera got, Core.Camera want, double roundings)
        {
            Close(got.CameraFromWorld, Doubles(want.CameraFromWorld), roundings);
            Close(got.ClipFromWorld, Doubles(want.ClipFromWorld), roundings);
            Close(got.Centre, Doubles(want.Centre), roundings);
            Close(got.TanHalfFov, Doubles(want.TanHalfFov), roundings);
            Assert.AreEqual(new[] { want.Width, want.Height }, new[] { got.Width, got.Height });
        }

        private static double[] Doubles(float[] values)
        {
            return values.Select(one => (double)one).ToArray();
        }

        /// <summary>The camera that OpenGL's matrices describe: looking along -z, y up, row-major.</summary>
        [Test]
        public void ACameraOfAnEngineSeesWhatOrbitSees()
        {
            Core.Camera orbit = new Core.Camera(), engine = new Core.Camera(), same = new Core.Camera();
            orbit.Orbit(new[] { 0.1, 0.2, 0.3 }, 2, 0.3, 0.2, Math.PI / 6, 200, 100);
            double[] view = Doubles(orbit.CameraFromWorld);
            for (int i = 4; i < 12; i++) view[i] = -view[i]; // y up, z backwards
            double along = 1 / Math.Tan(Math.PI / 12);
            double[] projection = { along / 2, 0, 0, 0, 0, along, 0, 0, 0, 0, -1.2, -0.4, 0, 0, -1, 0 };
            engine.SetFrom(view, projection, 200, 100);
            Close(engine, orbit, 8);
            same.Copy(engine);
            Close(same, engine, 0);
            for (int i = 8; i < 12; i++) view[i] = -view[i]; // one that looks along +z
            projection[14] = 1;
            same.SetFrom(view, projection, 200, 100);
            Close(same, engine, 0);
        }

        [Test]
        public void AnOffCentreProjectionIsTaken()
        {
            var camera = new Core.Camera();
            double[] still = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };
            double[] projection = { 2, 0, 0.25, 0, 0, 3, -0.5, 0, 0, 0, -1, -0.1, 0, 0, -1, 0 };
            camera.SetFrom(still, projection, 64, 64);
            double[] p = { 0.3, -0.2, -2, 1 }; // clip of the engine: x 0.1, y 0.4, w 2; ours has y down
            double[] clip = new[] { 0, 1, 3 }.Select(row => Enumerable.Range(0, 4).Sum(i => camera.ClipFromWorld[4 * row + i] * p[i])).ToArray();
            Near.Check(clip, new[] { 0.1, -0.4, 2 }, 1e-6, "clip");
        }

        [Test]
        public void WhatIsNoPerspectiveCameraIsRefused()
        {
            var camera = new Core.Camera();
            double[] still = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };
            AvatarError error = Assert.Throws<AvatarError>(() => camera.SetFrom(still, still, 64, 64));
            StringAssert.Contains("orthographic", error.Message);
            error = Assert.Throws<AvatarError>(() => camera.Orbit(new double[3], 1, 0, 0, 1, 0, 64));
            StringAssert.Contains("0x64", error.Message);
        }
    }
}
