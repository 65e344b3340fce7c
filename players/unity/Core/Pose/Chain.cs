using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>Stage joints, float64: skin matrices of a skeleton.</summary>
    internal sealed class Chain {
        /// <summary>Skin matrices, mesh from binding mesh, [J, 3, 4].</summary>
        public readonly double[] Skin;

        private readonly int[] parents;
        private readonly double[] basis; // [K, J, 3]
        private readonly double[] local; // [J, 3, 4] parent from joint at rest
        private readonly double[] inverseBind; // [J, 3, 4]
        private readonly double[] fromMesh; // [J, 3, 4] inverse of the linear part of the parent's rest transform
        private readonly double[] moved; // [J, 3] how expressions move rest joints, mesh space
        private readonly double[] posed; // [J, 3, 4]
        private readonly int[] moving; // expressions that move a joint
        private readonly double[] step = new double[12];

        public Chain(Skeleton skeleton) {
            int joints = skeleton.Names.Length;
            parents = skeleton.Parents;
            basis = skeleton.JointBasis;
            Skin = new double[12 * joints];
            local = RestPose.Rows(skeleton.RestLocal);
            inverseBind = RestPose.Rows(skeleton.InverseBindMatrix);
            fromMesh = InverseRest(parents, local);
            moved = new double[3 * joints];
            posed = new double[12 * joints];
            moving = MovingExpressions(basis, 3 * joints);
        }

        /// <summary>Computes Skin of weights [K] and deltas [J, 4, 4].</summary>
        public void Update(float[] weights, double[] delta) {
            SetRest(weights);
            for (int joint = 0; joint < parents.Length; joint++) {
                RestStep(joint, step);
                Affine.Multiply(step, 0, step, 0, delta, 16 * joint);
                Place(joint, step);
            }
        }

        /// <summary>How the weights [K] move the rest joints: RestStep and Place need it first.</summary>
        public void SetRest(float[] weights) {
            Array.Clear(moved, 0, moved.Length);
            for (int i = 0; i < moving.Length; i++) {
                double weight = weights[moving[i]];
                if (weight == 0) continue;
                for (int c = 0, at = moving[i] * moved.Length; c < moved.Length; c++, at++) {
                    moved[c] += weight * basis[at];
                }
            }
        }

        /// <summary>
        /// Writes B'_parent^-1 B'_joint [3, 4] with B'_j = T(d_j) B_j. Its linear part is that of rest_local; its
        /// translation gains (d_joint - d_parent) in the parent's frame. Of a root it is B'_joint.
        /// </summary>
        public void RestStep(int joint, double[] into) {
            int parent = parents[joint], at = 12 * joint;
            Array.Copy(local, at, into, 0, 12);
            if (moving.Length == 0) return;
            int j = 3 * joint, p = 3 * parent;
            double x = moved[j] - (parent < 0 ? 0 : moved[p]);
            double y = moved[j + 1] - (parent < 0 ? 0 : moved[p + 1]);
            double z = moved[j + 2] - (parent < 0 ? 0 : moved[p + 2]);
            for (int row = 0; row < 12; row += 4) {
                int i = at + row;
                into[row + 3] += fromMesh[i] * x + fromMesh[i + 1] * y + fromMesh[i + 2] * z;
            }
        }

        /// <summary>
        /// Writes bone_from_joint [3, 4] for moved rest joints: bind^-1 T(d_joint) inverse_bind^-1, of "still" [J, 3,
        /// 4], which is that without the move, and rigid bind transforms [J, 3, 4].
        /// </summary>
        public void MovedFrom(int joint, double[] still, double[] bind, double[] into) {
            int at = 12 * joint;
            Array.Copy(still, at, into, 0, 12);
            if (moving.Length == 0) return;
            double x = moved[3 * joint], y = moved[3 * joint + 1], z = moved[3 * joint + 2];
            for (int c = 0; c < 3; c++) {
                into[4 * c + 3] += bind[at + c] * x + bind[at + 4 + c] * y + bind[at + 8 + c] * z;
            }
        }

        /// <summary>
        /// Sets a joint whose transform in its parent's space is parentFromJoint [3, 4]; its parent is set.
        /// </summary>
        private void Place(int joint, double[] parentFromJoint) {
            int parent = parents[joint], at = 12 * joint;
            if (parent >= 0) Affine.Multiply(posed, at, posed, 12 * parent, parentFromJoint, 0);
            else Array.Copy(parentFromJoint, 0, posed, at, 12);
            Affine.Multiply(Skin, at, posed, at, inverseBind, at);
            if (moving.Length == 0) return;
            double x = moved[3 * joint], y = moved[3 * joint + 1], z = moved[3 * joint + 2];
            for (int i = at; i < at + 12; i += 4) Skin[i + 3] -= Skin[i] * x + Skin[i + 1] * y + Skin[i + 2] * z;
        }

        /// <summary>For each joint the inverse of its parent's linear part at rest; the identity for a root.</summary>
        private static double[] InverseRest(int[] parents, double[] local) {
            double[] rest = RestPose.Linear(parents, local);
            var found = new double[local.Length];
            for (int joint = 0; joint < parents.Length; joint++) {
                int at = 12 * joint;
                if (parents[joint] < 0) found[at] = found[at + 5] = found[at + 10] = 1;
                else Affine.InvertLinear(found, at, rest, 12 * parents[joint]);
            }
            return found;
        }

        private static int[] MovingExpressions(double[] basis, int floats) {
            var found = new List<int>();
            for (int k = 0; floats > 0 && k * floats < basis.Length; k++) {
                bool moves = false;
                for (int at = k * floats; at < (k + 1) * floats; at++) moves |= basis[at] != 0;
                if (moves) found.Add(k);
            }
            return found.ToArray();
        }
    }
}
