using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>
    /// A pose of one avatar. Its arrays are in the frame of the pack and may be written directly. No method allocates,
    /// but for its errors.
    /// </summary>
    public sealed class AvatarPose {
        /// <summary>Weights of the expressions, [K], in the avatar's order.</summary>
        public readonly float[] ExpressionWeights;

        /// <summary>Weights of the eyelids, [L], in the avatar's order.</summary>
        public readonly float[] LateWeights;

        /// <summary>
        /// parent_from_joint = rest_local delta, [J, 4, 4] row-major: affine matrices, whose last row is not read.
        /// </summary>
        public readonly double[] JointDelta;

        /// <summary>Rigid transform of the posed avatar as a whole, [4, 4] row-major.</summary>
        public readonly double[] WorldFromAvatar = new double[16];

        private readonly PoseNames names;
        private readonly double side; // a rotation vector keeps x in a mirror

        /// <summary>The rest pose of an avatar.</summary>
        public AvatarPose(LoadedAvatar avatar) {
            names = PoseNames.Of(avatar);
            side = avatar.Handedness == "left" ? -1 : 1;
            ExpressionWeights = new float[avatar.Expressions.Length];
            LateWeights = new float[avatar.Eyelids.Length];
            JointDelta = new double[16 * names.Joints.Count];
            Reset();
        }

        /// <summary>Back to rest: weights 0, joints and the whole avatar unmoved.</summary>
        public void Reset() {
            Array.Clear(ExpressionWeights, 0, ExpressionWeights.Length);
            Array.Clear(LateWeights, 0, LateWeights.Length);
            for (int at = 0; at < JointDelta.Length; at += 16) Affine.SetIdentity(JointDelta, at, 4);
            Affine.SetIdentity(WorldFromAvatar, 0, 4);
        }

        /// <summary>Takes over all values of another pose of the same avatar.</summary>
        public void Copy(AvatarPose other) {
            Array.Copy(other.ExpressionWeights, ExpressionWeights, ExpressionWeights.Length);
            Array.Copy(other.LateWeights, LateWeights, LateWeights.Length);
            Array.Copy(other.JointDelta, JointDelta, JointDelta.Length);
            Array.Copy(other.WorldFromAvatar, WorldFromAvatar, WorldFromAvatar.Length);
        }

        /// <summary>
        /// Sets an expression by its name or an alias. Throws AvatarError for an unknown name and a weight beyond
        /// float32.
        /// </summary>
        public void SetExpression(string name, double weight) {
            int index;
            if (!names.Expressions.TryGetValue(name, out index)) throw Unknown("expression", name, names.Listed);
            ExpressionWeights[index] = (float)Finite("expression", name, weight);
        }

        /// <summary>Sets an eyelid by name. Throws AvatarError as SetExpression.</summary>
        public void SetEyelid(string name, double weight) {
            int index;
            if (!names.Eyelids.TryGetValue(name, out index)) throw Unknown("eyelid", name, names.Eyelids.Keys);
            LateWeights[index] = (float)Finite("eyelid", name, weight);
        }

        /// <summary>
        /// Turns a joint by a rotation vector (axis times angle, radians) in the joint's rest frame, right-handed for
        /// every pack. Its own translation and scale are reset. Throws AvatarError for an unknown name and an angle
        /// that is not finite.
        /// </summary>
        public void SetJoint(string name, double rx, double ry, double rz) {
            int index;
            if (!names.Joints.TryGetValue(name, out index)) throw Unknown("joint", name, names.Joints.Keys);
            Finite("joint", name, rx + ry + rz);
            Affine.SetIdentity(JointDelta, 16 * index, 4);
            Affine.SetRotation(JointDelta, 16 * index, rx, side * ry, side * rz);
        }

        private static AvatarError Unknown(string what, string name, IEnumerable<string> known) {
            return AvatarError.NoSuch(what + " of this avatar", name, new List<string>(known));
        }

        private static double Finite(string what, string name, double value) {
            if (!(Math.Abs(value) <= float.MaxValue)) {
                throw new AvatarError(Json.Shown(value) + " is not a finite float32", null, what + " " + name);
            }
            return value;
        }
    }
}
