using System.Collections.Generic;
using System.Linq;
using AvatarExport.Editor;
using NUnit.Framework;
using UnityEngine.Rendering;

namespace AvatarExport.Tests
{
    /// <summary>Settings that do not suit avatars are found, each with the menu where it is changed.</summary>
    [TestFixture]
    public sealed class ProjectCheckTests
    {
        private static ProjectFacts Sound()
        {
            return new ProjectFacts
            {
                Platform = "StandaloneWindows64",
                Apis = new[] { GraphicsDeviceType.Direct3D11, GraphicsDeviceType.Vulkan },
                EditorApi = GraphicsDeviceType.Direct3D11,
                EditorHasCompute = true,
                Pipeline = Pipeline.Universal,
                CustomPasses = true,
            };
        }

        private static Finding Only(ProjectFacts facts)
        {
            List<Finding> found = ProjectCheck.Of(facts);
            Assert.AreEqual(1, found.Count, string.Join(" | ", found.Select(one => one.ToString()).ToArray()));
            Assert.Greater(found[0].Remedy.Length, 10);
            return found[0];
        }

        [Test]
        public void NewProjectsAreSound()
        {
            Assert.AreEqual(0, ProjectCheck.Of(Sound()).Count);
        }

        [TestCase("Android", GraphicsDeviceType.OpenGLES3, false, "Require ES3.1")]
        [TestCase("WebGL", GraphicsDeviceType.OpenGLES3, true, "WebGPU")]
        [TestCase("StandaloneOSX", GraphicsDeviceType.OpenGLCore, true, "Metal")]
        [TestCase("Android", GraphicsDeviceType.Null, true, "-nographics")]
        public void ApisWithoutComputeAreNamed(string platform, GraphicsDeviceType api, bool stops, string remedy)
        {
            ProjectFacts facts = Sound();
            facts.Platform = platform;
            facts.Apis = new[] { GraphicsDeviceType.Vulkan, api };
            Finding found = Only(facts);
            Assert.AreEqual(stops, found.Stops);
            StringAssert.Contains(remedy, found.Remedy);
        }

        [Test]
        public void OpenGlOnLinuxIsSound()
        {
            ProjectFacts facts = Sound();
            facts.Platform = "StandaloneLinux64";
            facts.Apis = new[] { GraphicsDeviceType.OpenGLCore };
            Assert.AreEqual(0, ProjectCheck.Of(facts).Count);
        }

        [Test]
        public void TheRestIsNamed()
        {
            ProjectFacts facts = Sound();
            facts.EditorHasCompute = false;
            StringAssert.Contains("Direct3D11", Only(facts).What);
            facts = Sound();
            facts.Pipeline = Pipeline.Other;
            Assert.IsTrue(Only(facts).Stops);
            facts = Sound();
            facts.Pipeline = Pipeline.HighDefinition;
            facts.CustomPasses = false;
            StringAssert.Contains("Custom Pass", Only(facts).Remedy);
            facts = Sound();
            facts.ClampsBlendShapes = true;
            Assert.IsFalse(Only(facts).Stops);
        }

        [Test]
        public void TheWorstComesFirst()
        {
            ProjectFacts facts = Sound();
            facts.Platform = "Android";
            facts.ClampsBlendShapes = true;
            facts.Apis = new[] { GraphicsDeviceType.OpenGLES3, GraphicsDeviceType.Null };
            Assert.AreEqual(new[] { true, false, false }, ProjectCheck.Of(facts).Select(one => one.Stops).ToArray());
        }
    }
}
