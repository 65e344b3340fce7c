using System;
using System.Linq;
using AvatarExport.Editor;
using NUnit.Framework;
using UnityEditor;
using UnityEngine;

namespace AvatarExport.Tests
{
    /// <summary>Curves of AnimationClips give the poses that Core samples from the clip, on frames and between them.</summary>
    [TestFixture]
    public sealed class ClipCurvesTests
    {
        private const double Rounding = 1.0 / (1 << 24); // of float32
        private const double Turn = 4e-3; // of quaternions between two frames: both mix components, Core before, curves after the bones' frame

        private static RigPaths PathsOf(Core.Avatar avatar)
        {
            string[] bones = avatar.Skeleton.Names.Select((name, joint) => "root/" + joint).ToArray();
            return new RigPaths { Mesh = "mesh", Root = "root", Bones = bones };
        }

        private static string[] ShapesOf(Core.Avatar avatar)
        {
            return Core.ProxyMesh.From(avatar).Morphs.Select(morph => morph.Name).ToArray();
        }

        private static double At(AnimationClip clip, string path, Type type, string property, double seconds, double absent)
        {
            AnimationCurve curve = AnimationUtility.GetEditorCurve(clip, EditorCurveBinding.FloatCurve(path, type, property));
            return curve == null ? absent : curve.Evaluate((float)seconds);
        }

        private static double At(AnimationClip clip, string path, string property, int axis, double seconds)
        {
            return At(clip, path, typeof(Transform), property + "." + "xyzw"[axis], seconds, double.NaN);
        }

        [TestCase("head", 0)]
        [TestCase("head", 1)]
        [TestCase("body", 2)]
        [TestCase("joints", 0)]
        public void CurvesAreTheClip(string name, int index)
        {
            byte[] file = name == "head" ? TestPacks.Head() : name == "body" ? TestPacks.Body() : TestPacks.Golden(name);
            Core.Avatar avatar = Core.Pack.Read(file, name);
            var clip = new Core.Clip(avatar, index);
            string[] shapes = ShapesOf(avatar);
            AnimationClip made = ClipCurves.Of(avatar, index, shapes, PathsOf(avatar));
            Assert.AreEqual(clip.Name, made.name);
            Assert.AreEqual(clip.Fps, made.frameRate, 0);
            int frames = (int)Math.Round(clip.Seconds * clip.Fps) + 1;
            for (int half = 0; half <= 2 * (frames - 1); half += half % 2 == 0 ? 25 : 12) Check(avatar, clip, made, shapes, half);
        }

        private static void Check(Core.Avatar avatar, Core.Clip clip, AnimationClip made, string[] shapes, int half)
        {
            double seconds = half / 2 / clip.Fps + half % 2 * 0.5 / clip.Fps;
            bool onFrame = half % 2 == 0;
            double late = 2 * seconds * clip.Fps * Rounding; // frames: times of curves are float32
            var pose = new Core.Pose(avatar);
            clip.Sample(seconds, pose);
            float[] weights = pose.ExpressionWeights.Concat(pose.LateWeights).ToArray();
            for (int k = 0; k < weights.Length; k++)
            {
                double found = At(made, "mesh", typeof(SkinnedMeshRenderer), "blendShape." + shapes[k], seconds, 0);
                Assert.AreEqual(100 * weights[k], found, 100 * (64 * Rounding + late), shapes[k]);
            }
            var poser = new Core.BoneFrames(avatar);
            var bones = new Core.Bones(avatar.Skeleton.Names.Length);
            double[] translation = new double[3], rotation = new double[4];
            poser.ToBones(pose, bones);
            poser.ToRoot(pose, translation, rotation);
            CheckTransform(made, "root", seconds, translation, rotation, 0, onFrame);
            for (int j = 0; j < avatar.Skeleton.Names.Length; j++)
            {
                CheckTransform(made, "root/" + j, seconds, bones.Translation, bones.Rotation, j, onFrame);
                for (int i = 0; i < 3; i++)
                {
                    Assert.AreEqual(bones.Scale[3 * j + i], At(made, "root/" + j, "localScale", i, seconds), onFrame ? 16 * Rounding : Turn, "scale");
                }
            }
        }

        private static void CheckTransform(AnimationClip made, string path, double seconds, double[] translation, double[] rotation, int j, bool onFrame)
        {
            for (int i = 0; i < 3; i++)
            {
                double found = At(made, path, "localPosition", i, seconds);
                Assert.AreEqual(translation[3 * j + i], found, onFrame ? 64 * Rounding : Turn, path + " position at " + seconds);
            }
            double[] q = Enumerable.Range(0, 4).Select(i => At(made, path, "localRotation", i, seconds)).ToArray();
            double length = Math.Sqrt(q.Sum(one => one * one));
            double along = Enumerable.Range(0, 4).Sum(i => q[i] * rotation[4 * j + i]) / length;
            Assert.AreEqual(1, Math.Abs(along), onFrame ? 16 * Rounding : Turn * Turn, path + " rotation at " + seconds);
        }

        [Test]
        public void WhatStaysAtRestHasNoCurve()
        {
            Core.Avatar avatar = Core.Pack.Read(TestPacks.Head(), "head");
            AnimationClip made = ClipCurves.Of(avatar, 0, ShapesOf(avatar), PathsOf(avatar));
            EditorCurveBinding[] shapes = AnimationUtility.GetCurveBindings(made).Where(one => one.type == typeof(SkinnedMeshRenderer)).ToArray();
            Assert.Greater(shapes.Length, 0);
            Assert.Less(shapes.Length, 53);
            foreach (EditorCurveBinding shape in shapes)
            {
                Keyframe[] keys = AnimationUtility.GetEditorCurve(made, shape).keys;
                Assert.IsTrue(keys.Any(key => key.value != 0), shape.propertyName);
            }
        }
    }
}
