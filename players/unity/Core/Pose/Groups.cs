using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>Part of stage joints: one rigid or mixed transform for each group of Gaussians.</summary>
    internal sealed class Groups {
        /// <summary>Mesh from binding mesh, [G, 3, 4].</summary>
        public readonly float[] Matrix;

        /// <summary>Rotations of quaternions and of SH, [G, 3, 4] with a last column of 0.</summary>
        public readonly float[] Rotation;

        /// <summary>The anchor vertices; null where no group needs them.</summary>
        public readonly Anchors Anchors;

        private readonly int[] order; // anchor i of the avatar's list -> its row in Anchors
        private readonly double[] weights; // of each row in Anchors
        private readonly double[] centre = new double[3];
        private readonly JointMix[] mixes;
        private readonly SplatGroup[] groups;
        private readonly int headBone = -1; // -1: none
        private readonly double[] made = new double[12];
        private readonly double[] fitted = new double[12]; // to the anchors
        private readonly double[] inverse = new double[12];
        private readonly RigidFit fit = new RigidFit();

        public Groups(LoadedAvatar avatar) {
            groups = avatar.Groups;
            Matrix = new float[12 * groups.Length];
            Rotation = new float[12 * groups.Length];
            Dictionary<string, int> joints = PoseNames.Of(avatar).Joints;
            mixes = new JointMix[groups.Length];
            for (int g = 0; g < groups.Length; g++) {
                for (int k = 0; k < 12; k += 5) Matrix[12 * g + k] = Rotation[12 * g + k] = 1;
                mixes[g] = new JointMix(groups[g], joints);
            }
            if (Rule(avatar, "rotation") == "head_bone") {
                string name = Rule(avatar, "rotation_joint");
                if (name == null || !joints.TryGetValue(name, out headBone)) headBone = -1;
            }
            uint[] listed = AnchorVertices(avatar);
            uint[] unique = Sorted(listed);
            Anchors = unique.Length > 0 ? new Anchors(avatar.Program, unique) : null;
            order = new int[listed.Length];
            weights = new double[unique.Length];
            for (int i = 0; i < listed.Length; i++) {
                int row = order[i] = Array.BinarySearch(unique, listed[i]);
                weights[row] = Rule(avatar, "anchor") == "unique" ? 1 : weights[row] + 1;
            }
            if (Anchors != null) RigidFit.SetMean(centre, Anchors.Rest, weights);
        }

        /// <summary>
        /// Takes posed anchor vertices [A, 3], in the order of Skeleton.AnchorVertices, in place of computed ones.
        /// </summary>
        public void SetAnchors(float[] vertices) {
            for (int i = 0; i < order.Length; i++) {
                for (int c = 0; c < 3; c++) Anchors.Posed[3 * order[i] + c] = vertices[3 * i + c];
            }
        }

        /// <summary>Computes Matrix and Rotation of skin matrices [J, 3, 4] and the posed anchors.</summary>
        public void Update(double[] skin) {
            if (Anchors != null) fit.Write(fitted, Anchors.Rest, Anchors.Posed, weights, centre);
            for (int g = 0; g < groups.Length; g++) {
                string binding = groups[g].Binding;
                if (binding == "anchor" && Anchors != null) {
                    Array.Copy(fitted, made, 12);
                    Write(g, true);
                } else if (binding == "joint_mix") {
                    mixes[g].Write(made, skin);
                    Write(g, true);
                    Turn(g);
                } else if (binding == "skin" && headBone >= 0) {
                    Array.Copy(skin, 12 * headBone, made, 0, 12);
                    Turn(g);
                }
            }
        }

        /// <summary>The group's rotation is that of what is made.</summary>
        private void Turn(int g) {
            Affine.Polar(made, 0, Constants.PolarSteps, inverse);
            Write(g, false);
        }

        /// <summary>Copies what is made to the group's rotation, and with "whole" to its matrix too.</summary>
        private void Write(int g, bool whole) {
            for (int k = 0, at = 12 * g; k < 12; k++, at++) {
                Rotation[at] = k % 4 == 3 ? 0 : (float)made[k];
                if (whole) Matrix[at] = (float)made[k];
            }
        }

        private static string Rule(LoadedAvatar avatar, string name) {
            string value;
            return avatar.Rules.TryGetValue(name, out value) ? value : null;
        }

        /// <summary>The anchor vertices, repeats kept; none where no group follows them.</summary>
        private static uint[] AnchorVertices(LoadedAvatar avatar) {
            bool needed = avatar.Skeleton != null && Array.Exists(avatar.Groups, group => group.Binding == "anchor");
            return needed ? avatar.Skeleton.AnchorVertices : new uint[0];
        }

        private static uint[] Sorted(uint[] listed) {
            var unique = new List<uint>(new HashSet<uint>(listed));
            unique.Sort();
            return unique.ToArray();
        }
    }
}
