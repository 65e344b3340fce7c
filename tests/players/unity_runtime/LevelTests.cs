using System.Collections.Generic;
using System.IO;
using System.Reflection;
using System.Runtime.CompilerServices;
using NUnit.Framework;
using UnityEngine;

namespace AvatarExport.Tests
{
    /// <summary>Levels by the height on the screen, and the frame of boxes and turns.</summary>
    public sealed class LevelTests
    {
        private Stage stage;

        [SetUp]
        public void Begin()
        {
            stage = new Stage();
        }

        [Test]
        public void TheLevelIsThatOfTheHeightOnTheScreen()
        {
            GaussianAvatar avatar = stage.Add(Packs.Joints);
            avatar.Level = 99; // more than there are: the coarsest
            Assert.IsNotNull(stage.Frame());
            avatar.Level = -1;
            for (int i = 0; i < 3; i++) Assert.IsNotNull(stage.Frame());
            stage.End();
        }

        [TestCase("right")]
        [TestCase("left")]
        public void TheLevelFollowsThePixelsOfTheFramingsHeight(string hand)
        {
            const float Tall = 0.242f, Border = 60; // of the pack: metres of its framing, pixels of level 1
            GaussianAvatar avatar = stage.Add(Packs.Joints);
            avatar.Load(Mole(hand), hand);
            var found = new List<int>();
            foreach (float share in new[] { 1.05f, 0.95f, 0.8f, 1.05f, 1.2f, 0.5f })
            {
                Matrix4x4 view = stage.Camera.worldToCameraMatrix;
                view.m23 = -stage.Camera.projectionMatrix.m11 * Tall * Stage.Height / 2 / (share * Border);
                stage.Camera.worldToCameraMatrix = view;
                for (int i = 0; i < 2; i++) Assert.IsNotNull(stage.Frame()); // the next frame shows the level of this one
                found.Add(((Core.Instance)Field(avatar, "instance")).Level);
            }
            Assert.AreEqual(new[] { 0, 0, 1, 1, 0, 1 }, found.ToArray());
            stage.End();
        }

        [TestCase("right")]
        [TestCase("left")]
        public void BoxesAndTurnsAreInUnitysFrame(string hand)
        {
            GaussianAvatar avatar = stage.Add(Packs.Joints);
            avatar.Load(Mole(hand), hand);
            Assert.AreEqual(-0.05f, avatar.WorldBounds.center.x, 0.02f); // it stands 5 cm to the person's left
            avatar.SetJoint("neck", new Quaternion(0, 0.28f, 0, 0.96f));
            stage.Frame();
            double wanted = 2 * 0.28 * 0.96; // x of what was z, by the quaternion alone
            Assert.AreEqual(hand == "left" ? wanted : -wanted, avatar.Pose.JointDelta[16 + 2], 1e-6);
            stage.End();
        }

        private static byte[] Mole(string hand, [CallerFilePath] string here = "")
        {
            string[] path = { Path.GetDirectoryName(here), "..", "..", "data", "mole", hand + ".avatar" };
            return File.ReadAllBytes(Path.Combine(path));
        }

        private static object Field(object of, string name)
        {
            return of.GetType().GetField(name, BindingFlags.Instance | BindingFlags.NonPublic).GetValue(of);
        }
    }
}
