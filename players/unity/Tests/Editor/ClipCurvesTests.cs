using System;
using System.Linq;
using AvatarExport.Core;
using AvatarExport.Editor;
using NUnit.Framework;
using UnityEditor;
using UnityEngine;

namespace AvatarExport.Tests {
    /// <summary>Curves of AnimationClips give the poses that Core samples from the clip, on frames and between them.</summary>
    public sealed class ClipCurvesTests {
        private const double Rounding = 1.0 / (1 << 24); // of float32
        private const double Turn = 4e-3; // of quaternions between two frames: both mix components, Core before, curves after the bones' frame

        [TestCase("head", 0)]
        [TestCase("head", 1)]
        [TestCase("body", 2)]
        [TestCase("joints", 0)]
        public void CurvesAreTheClip(string name, int index) {
            LoadedAvatar avatar = TestPacks.Read(name);
            Clip clip = avatar.Clips[index];
            string[] shapes = ProxyMesh.From(avatar).Morphs.Select(morph => morph.Name).ToArray();
            string[] bones = avatar.Skeleton.Names.Select((_, joint) => "root/" + joint).ToArray();
            AnimationClip made = ClipCurves.Of(avatar, clip, shapes, new RigPaths { Mesh = "mesh", Root = "root", Bones = bones });
            Assert.AreEqual(clip.Name, made.name);
            Assert.AreEqual(clip.Fps, made.frameRate, 0);
            int last = 2 * (clip.Frames - 1);
            for (int half = 0; half <= last; half += half % 2 == 0 ? 25 : 12) Check(avatar, clip, made, shapes, half);
            EditorCurveBinding[] moved = AnimationUtility.GetCurveBindings(made).Where(one => one.path == "mesh").ToArray();
            foreach (EditorCurveBinding shape in moved) {
                Keyframe[] keys = AnimationUtility.GetEditorCurve(made, shape).keys;
                Assert.IsTrue(keys.Any(key => key.value != 0), shape.propertyName + " stays at rest");
            }
        }

        private static double At(AnimationClip made, string path, Type type, string property, double seconds, double absent = double.NaN) {
            AnimationCurve curve = AnimationUtility.GetEditorCurve(made, EditorCurveBinding.FloatCurve(path, type, property));
            return curve == null ? absent : curve.Evaluate((float)seconds);
        }

        private static void Check(LoadedAvatar avatar, Clip clip, AnimationClip made, string[] shapes, int half) {
            double seconds = half / 2 / clip.Fps + half % 2 * 0.5 / clip.Fps;
            bool onFrame = half % 2 == 0;
            double late = 2 * seconds * clip.Fps * Rounding; // frames: times of curves are float32
            var pose = new AvatarPose(avatar);
            clip.Pose(seconds, pose);
            float[] weights = pose.ExpressionWeights.Concat(pose.LateWeights).ToArray();
            for (int k = 0; k < weights.Length; k++) {
                double found = At(made, "mesh", typeof(SkinnedMeshRenderer), "blendShape." + shapes[k], seconds, 0);
                Assert.AreEqual(100 * weights[k], found, 100 * (64 * Rounding + late), shapes[k]);
            }
            var poser = new BoneFrames(avatar);
            var bones = new Bones(avatar.Skeleton.Names.Length);
            double[] translation = new double[3], rotation = new double[4];
            poser.ToBones(pose, bones);
            poser.ToRoot(pose, translation, rotation);
            CheckTransform(made, "root", seconds, onFrame, translation, rotation, null);
            for (int j = 0; j < avatar.Skeleton.Names.Length; j++) {
                double[] r = bones.Rotation.Skip(4 * j).Take(4).ToArray(), s = bones.Scale.Skip(3 * j).Take(3).ToArray();
                CheckTransform(made, "root/" + j, seconds, onFrame, bones.Translation.Skip(3 * j).Take(3).ToArray(), r, s);
            }
        }

        private static void CheckTransform(
            AnimationClip made, string path, double seconds, bool onFrame, double[] translation, double[] rotation, double[] scale) {
            Func<string, int, double> at = (property, i) => At(made, path, typeof(Transform), property + "." + "xyzw"[i], seconds);
            for (int i = 0; i < 3; i++) {
                Assert.AreEqual(translation[i], at("localPosition", i), onFrame ? 64 * Rounding : Turn, path + " position at " + seconds);
                if (scale != null) Assert.AreEqual(scale[i], at("localScale", i), onFrame ? 16 * Rounding : Turn, path + " scale");
            }
            double[] q = Enumerable.Range(0, 4).Select(i => at("localRotation", i)).ToArray();
            double along = q.Zip(rotation, (a, b) => a * b).Sum() / Math.Sqrt(q.Sum(one => one * one));
            Assert.AreEqual(1, Math.Abs(along), onFrame ? 16 * Rounding : Turn * Turn, path + " rotation at " + seconds);
        }
    }
}
