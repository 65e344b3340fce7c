using System;
using System.Collections.Generic;
using System.Linq;
using AvatarExport.Editor;
using NUnit.Framework;
using UnityEngine.Rendering;

namespace AvatarExport.Tests {
    /// <summary>Settings that do not suit avatars are found, each with the menu where it is changed.</summary>
    public sealed class ProjectCheckTests {
        private static List<Finding> Found(string platform, GraphicsDeviceType[] apis, bool compute = true,
            Pipeline pipeline = Pipeline.Universal, bool clamps = false) {
            return ProjectCheck.Of(new ProjectFacts {
                Platform = platform,
                Apis = apis,
                EditorApi = GraphicsDeviceType.Direct3D11,
                EditorHasCompute = compute,
                Pipeline = pipeline,
                CustomPasses = pipeline != Pipeline.HighDefinition,
                ClampsBlendShapes = clamps,
            });
        }

        [TestCase("StandaloneWindows64", GraphicsDeviceType.Direct3D11, null, null)]
        [TestCase("StandaloneLinux64", GraphicsDeviceType.OpenGLCore, null, null)]
        [TestCase("Android", GraphicsDeviceType.OpenGLES3, false, "Require ES3.1")]
        [TestCase("WebGL", GraphicsDeviceType.OpenGLES3, true, "WebGPU")]
        [TestCase("StandaloneOSX", GraphicsDeviceType.OpenGLCore, true, "Metal")]
        [TestCase("Android", GraphicsDeviceType.Null, true, "-nographics")]
        public void ApisWithoutComputeAreNamed(string platform, GraphicsDeviceType api, bool? stops, string remedy) {
            AssertOnly(Found(platform, new[] { GraphicsDeviceType.Vulkan, api }), stops, remedy);
        }

        [TestCase(false, Pipeline.Universal, false, true, "Direct3D11")]
        [TestCase(true, Pipeline.Other, false, true, "URP or HDRP")]
        [TestCase(true, Pipeline.HighDefinition, false, true, "Custom Pass")]
        [TestCase(true, Pipeline.Universal, true, false, "Clamp BlendShapes")]
        public void TheRestIsNamed(bool compute, Pipeline pipeline, bool clamps, bool stops, string remedy) {
            AssertOnly(Found("StandaloneWindows64", new GraphicsDeviceType[0], compute, pipeline, clamps), stops, remedy);
        }

        private static void AssertOnly(List<Finding> found, bool? stops, string remedy) {
            Assert.AreEqual(stops.HasValue ? 1 : 0, found.Count, string.Join(" | ", found.Select(one => one.ToString()).ToArray()));
            if (!stops.HasValue) return;
            Assert.AreEqual(stops.Value, found[0].Stops);
            StringAssert.Contains(remedy, found[0].Remedy);
        }

        [Test]
        public void TheWorstComesFirst() {
            GraphicsDeviceType[] apis = { GraphicsDeviceType.OpenGLES3, GraphicsDeviceType.Null };
            Assert.AreEqual(new[] { true, false, false }, Found("Android", apis, clamps: true).Select(one => one.Stops));
        }
    }
}
