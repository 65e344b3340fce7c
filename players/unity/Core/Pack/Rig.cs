using System;
using System.Collections.Generic;
using System.Linq;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>The skeleton of a pack, for stage joints.</summary>
    internal static class Rig {
        private const float Largest = 1e6f; // number of a matrix
        private const double LeastVolume = 1e-18; // of the 3x3 part of a matrix that has an inverse
        private const double LeastAtRest = 1e-300; // the same through all parents
        private const int FewestAnchors = 3;

        /// <summary>The skeleton of joints `names` with K expressions and V mesh vertices. Throws AvatarError.</summary>
        public static Skeleton Read(
            Dictionary<string, HeldArray> arrays, string[] names, int expressions, long vertices) {
            int joints = names.Length;
            int[] parents = Taken(arrays, "rig.parents", "i32", joints).Copied<int>();
            float[] restLocal = Taken(arrays, "rig.rest_local", "f32", joints, 4, 4).Copied<float>();
            float[] inverseBind = Taken(arrays, "rig.inverse_bind_matrix", "f32", joints, 4, 4).Copied<float>();
            float[] basis = Taken(arrays, "rig.joint_basis", "f32", expressions, joints, 3).Copied<float>();
            int[] correctives = Taken(arrays, "rig.corrective_joints", "i32", -1).Copied<int>();
            uint[] anchors = Taken(arrays, "rig.anchor_vertices", "u32", -1).Copied<uint>();
            if (parents.Where((parent, joint) => parent >= joint || parent < -1).Any()) {
                string line = "a parent must come before its children; a root is -1";
                throw new AvatarError(line, null, "array rig.parents");
            }
            CheckAffine(restLocal, "array rig.rest_local");
            CheckRest(Array.ConvertAll(restLocal, value => (double)value), parents, names);
            CheckAffine(inverseBind, "array rig.inverse_bind_matrix");
            CheckFinite(basis, "array rig.joint_basis");
            CheckBelow(correctives.Select(joint => (long)joint), joints, "array rig.corrective_joints");
            CheckBelow(anchors.Select(vertex => (long)vertex), vertices, "array rig.anchor_vertices");
            return new Skeleton {
                Names = names,
                Parents = parents,
                RestLocal = Array.ConvertAll(restLocal, value => (double)value),
                InverseBindMatrix = Array.ConvertAll(inverseBind, value => (double)value),
                JointBasis = Array.ConvertAll(basis, value => (double)value),
                CorrectiveJoints = Array.ConvertAll(correctives, joint => (uint)joint),
                AnchorVertices = anchors,
            };
        }

        /// <summary>Corners [3, F] of the mesh of V vertices. Throws AvatarError.</summary>
        public static uint[] Triangles(Dictionary<string, HeldArray> arrays, long vertices) {
            const string name = "rig.triangles";
            uint[] corners = Taken(arrays, name, "u32", 3, -1).Copied<uint>();
            CheckBelow(corners.Select(vertex => (long)vertex), vertices, "array " + name);
            return corners;
        }

        /// <summary>An array of a type and shape; -1 is any length.</summary>
        private static Elements Taken(
            Dictionary<string, HeldArray> arrays, string name, string type, params long[] shape) {
            HeldArray held;
            if (!arrays.TryGetValue(name, out held)) throw new AvatarError("is missing", null, "array " + name);
            if (held.Is(type, shape)) return held.Elements;
            string line = "is " + held.Type + " " + Shown(held.Shape) + ", not " + type + " " + Shown(shape);
            throw new AvatarError(line, null, "array " + name);
        }

        /// <summary>A shape as a person reads it.</summary>
        public static string Shown(long[] shape) {
            return "[" + string.Join(", ", shape.Select(length => Invariant($"{length}")).ToArray()) + "]";
        }

        /// <summary>Throws AvatarError for a number that is not finite.</summary>
        public static void CheckFinite(float[] values, string field) {
            if (values.Any(value => float.IsNaN(value) || float.IsInfinity(value))) {
                throw new AvatarError("holds a number that is not finite", null, field);
            }
        }

        private static void CheckBelow(IEnumerable<long> values, long end, string field) {
            foreach (long value in values.Where(value => value < 0 || value >= end)) {
                throw new AvatarError(Invariant($"holds {value}; 0 to {end - 1} are taken"), null, field);
            }
        }

        private static void CheckAffine(float[] matrices, string field) {
            for (int at = 0; at < matrices.Length; at += 16) {
                bool small = true;
                for (int i = at; i < at + 16; i++) small &= Math.Abs(matrices[i]) <= Largest;
                if (!small || !HasAffineRow(matrices, at) || !(Math.Abs(Volume(matrices, at)) > LeastVolume)) {
                    string line = "is not an affine matrix with an inverse";
                    throw new AvatarError(line, null, Invariant($"{field}[{at / 16}]"));
                }
            }
        }

        /// <summary>Throws AvatarError for a joint whose rest transform through all its parents has no inverse.</summary>
        private static void CheckRest(double[] local, int[] parents, string[] names) {
            double[] rest = (double[])local.Clone();
            for (int joint = 0; joint < parents.Length; joint++) {
                int from = 16 * parents[joint], at = 16 * joint;
                for (int i = 0; parents[joint] >= 0 && i < 16; i++) {
                    rest[at + i] = 0;
                    for (int k = 0; k < 4; k++) rest[at + i] += rest[from + i / 4 * 4 + k] * local[at + 4 * k + i % 4];
                }
                bool isFinite = true;
                for (int i = 0; i < 16; i++) isFinite &= Math.Abs(rest[at + i]) <= double.MaxValue;
                if (isFinite && Math.Abs(Volume(rest, at)) > LeastAtRest) continue;
                string line = "joint " + names[joint] + " and its parents together have no inverse";
                throw new AvatarError(line, null, "array rig.rest_local");
            }
        }

        /// <summary>Whether the last row of a matrix [4, 4] at `at` is 0 0 0 1.</summary>
        public static bool HasAffineRow(float[] m, int at) {
            return m[at + 12] == 0 && m[at + 13] == 0 && m[at + 14] == 0 && m[at + 15] == 1;
        }

        /// <summary>The determinant of the 3x3 part of a matrix [4, 4] at `at`.</summary>
        public static double Volume(float[] m, int at) {
            return Volume(m[at], m[at + 1], m[at + 2], m[at + 4], m[at + 5], m[at + 6], m[at + 8], m[at + 9], m[at + 10]);
        }

        private static double Volume(double[] m, int at) {
            return Volume(m[at], m[at + 1], m[at + 2], m[at + 4], m[at + 5], m[at + 6], m[at + 8], m[at + 9], m[at + 10]);
        }

        private static double Volume(
            double a, double b, double c, double d, double e, double f, double g, double h, double i) {
            return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
        }

        /// <summary>Throws AvatarError for a group that asks for a joint or anchors that the skeleton lacks.</summary>
        public static void CheckGroups(SplatGroup[] groups, Skeleton skeleton, HashSet<string> joints) {
            foreach (SplatGroup group in groups) {
                string field = "group " + group.Name;
                if (skeleton == null && group.Binding != "none" && group.Binding != "surface") {
                    throw new AvatarError("binding '" + group.Binding + "' needs a skeleton", null, field);
                }
                if (group.Binding == "anchor" && skeleton.AnchorVertices.Length < FewestAnchors) {
                    string line = Invariant($"binding 'anchor' needs at least {FewestAnchors} anchor vertices");
                    throw new AvatarError(line, null, field);
                }
                if (group.Binding == "joint_mix" != group.JointMix.Length > 0) {
                    throw new AvatarError("joint_mix goes with binding 'joint_mix'", null, field);
                }
                foreach (KeyValuePair<string, double> one in group.JointMix) {
                    CheckJoint(one.Key, joints, field + ", joint_mix");
                }
            }
        }

        /// <summary>Throws AvatarError for a joint that is none of the avatar's; null is no joint.</summary>
        public static void CheckJoint(string name, HashSet<string> joints, string field) {
            if (name != null && !joints.Contains(name)) {
                throw AvatarError.NoSuch("joint of this avatar", name, joints.ToList(), field);
            }
        }
    }
}
