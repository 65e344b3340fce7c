using System;

namespace AvatarExport.Core {
    /// <summary>A skeleton at rest, in rows of [3, 4].</summary>
    internal static class RestPose {
        /// <summary>[J, 4, 4] without its last rows.</summary>
        public static double[] Rows(double[] matrices) {
            var found = new double[matrices.Length / 16 * 12];
            for (int joint = 0; 12 * joint < found.Length; joint++) {
                Array.Copy(matrices, 16 * joint, found, 12 * joint, 12);
            }
            return found;
        }

        /// <summary>
        /// Linear parts [J, 3, 4] of mesh_from_joint at rest; the fourth column is 0. "local" is [J, 3, 4].
        /// </summary>
        public static double[] Linear(int[] parents, double[] local) {
            var rest = (double[])local.Clone();
            for (int joint = 0; joint < parents.Length; joint++) {
                int at = 12 * joint;
                rest[at + 3] = rest[at + 7] = rest[at + 11] = 0;
                if (parents[joint] >= 0) Affine.MultiplyLinear(rest, at, rest, 12 * parents[joint], rest, at);
            }
            return rest;
        }

        /// <summary>mesh_from_joint at rest, [J, 3, 4].</summary>
        public static double[] Whole(Skeleton skeleton) {
            double[] rest = Rows(skeleton.RestLocal);
            for (int joint = 0; joint < skeleton.Parents.Length; joint++) {
                int parent = skeleton.Parents[joint];
                if (parent >= 0) Affine.Multiply(rest, 12 * joint, rest, 12 * parent, rest, 12 * joint);
            }
            return rest;
        }
    }
}
