using System;
using System.Collections.Generic;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>Compares arrays of numbers, and fills poses from them.</summary>
    internal static class Near {
        /// <summary>Every number is within the limit of the wanted one.</summary>
        public static void Check(IEnumerable<double> got, IEnumerable<double> want, double limit, string what) {
            double[] have = got.ToArray(), wanted = want.ToArray();
            Assert.AreEqual(wanted.Length, have.Length, what);
            for (int i = 0; i < have.Length; i++) Assert.AreEqual(wanted[i], have[i], limit, what + "[" + i + "]");
        }

        public static void Check(IEnumerable<float> got, IEnumerable<double> want, double limit, string what) {
            Check(got.Select(one => (double)one), want, limit, what);
        }

        /// <summary>Within some roundings of float32 of the largest wanted number.</summary>
        public static void Round(IEnumerable<float> got, double[] want, double roundings, string what) {
            Check(got, want, roundings * Cases.Rounding * Largest(want), what);
        }

        /// <summary>The largest size of a number, at least 1.</summary>
        public static double Largest(IEnumerable<double> values) => values.Select(Math.Abs).Concat(new[] { 1.0 }).Max();

        /// <summary>Row t of an array of so many rows.</summary>
        public static double[] Row(this double[] values, int t, int rows) {
            return values.Skip(t * (values.Length / rows)).Take(values.Length / rows).ToArray();
        }

        /// <summary>The pose of row t of arrays that Python wrote.</summary>
        public static void Take(this AvatarPose pose, Dictionary<string, double[]> held, int t) {
            Fill(pose.ExpressionWeights, held["expression_weights"], t);
            if (held.ContainsKey("late_weights")) Fill(pose.LateWeights, held["late_weights"], t);
            Array.Copy(held["joint_delta"], t * pose.JointDelta.Length, pose.JointDelta, 0, pose.JointDelta.Length);
            Array.Copy(held["world_from_avatar"], 16 * t, pose.WorldFromAvatar, 0, 16);
        }

        private static void Fill(float[] into, double[] values, int t) {
            for (int i = 0; i < into.Length; i++) into[i] = (float)values[t * into.Length + i];
        }

        public static void Same(AvatarPose want, AvatarPose got) {
            Assert.AreEqual(want.ExpressionWeights, got.ExpressionWeights);
            Assert.AreEqual(want.LateWeights, got.LateWeights);
            Assert.AreEqual(want.JointDelta, got.JointDelta);
            Assert.AreEqual(want.WorldFromAvatar, got.WorldFromAvatar);
        }

        public static void Same(DrivingFrame want, DrivingFrame got, string what = "") {
            Assert.AreEqual(want.Weights, got.Weights, what);
            Assert.AreEqual(want.Head, got.Head, what);
            Assert.AreEqual(want.LeftEye, got.LeftEye, what);
            Assert.AreEqual(want.RightEye, got.RightEye, what);
        }
    }
}
