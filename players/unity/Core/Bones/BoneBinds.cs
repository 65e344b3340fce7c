using System;

namespace AvatarExport.Core {
    /// <summary>The engine's bones of a skeleton in their bind pose: rigid, so that engines see scales of 1.</summary>
    internal static class BoneBinds {
        private const double Bound = 1e-5; // largest entry of a skin matrix at rest, less the identity, that is rounding

        /// <summary>
        /// Whether the mesh at rest is its template: rest and bind transforms are equal up to rounding.
        /// </summary>
        public static bool RestsBound(Skeleton skeleton) {
            double[] rest = RestPose.Whole(skeleton), inverseBind = RestPose.Rows(skeleton.InverseBindMatrix);
            double off = 0;
            for (int at = 0; at < rest.Length; at += 12) {
                Affine.Multiply(rest, at, rest, at, inverseBind, at);
                for (int k = 0; k < 12; k++) off = Math.Max(off, Math.Abs(rest[at + k] - (k % 5 == 0 ? 1 : 0)));
            }
            return !(off > Bound);
        }

        /// <summary>
        /// mesh from bone, [J, 3, 4], in the pack's frame: translation and nearest rotation of the rest transform, or
        /// of the bind transform where the rig does not rest in its binding pose. Throws AvatarError for a transform
        /// beyond float32.
        /// </summary>
        public static double[] Of(Skeleton skeleton) {
            double[] rest = RestPose.Whole(skeleton);
            double[] bind = RestsBound(skeleton) ? rest : Inverses(RestPose.Rows(skeleton.InverseBindMatrix));
            var nearest = new NearestRotation();
            var found = new double[bind.Length];
            var own = new double[12];
            var turn = new double[12];
            for (int at = 0; at < bind.Length; at += 12) {
                for (int k = 0; k < 12; k++) {
                    if (Math.Abs(rest[at + k]) <= float.MaxValue && Math.Abs(bind[at + k]) <= float.MaxValue) continue;
                    string message = "its rest transform does not fit float32; scale the rig to metres";
                    throw new AvatarError(message, null, "joint " + skeleton.Names[at / 12]);
                }
                Array.Copy(bind, at, own, 0, 12);
                nearest.Write(turn, own);
                for (int k = 0; k < 12; k++) found[at + k] = k % 4 == 3 ? own[k] : turn[k];
            }
            return found;
        }

        /// <summary>Inverses of affine [J, 3, 4].</summary>
        public static double[] Inverses(double[] matrices) {
            var found = new double[matrices.Length];
            for (int at = 0; at < found.Length; at += 12) Affine.Invert(found, at, matrices, at);
            return found;
        }
    }
}
