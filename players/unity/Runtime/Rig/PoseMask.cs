using AvatarExport.Core;

namespace AvatarExport {
    /// <summary>Which values of a pose a source sets.</summary>
    internal sealed class PoseMask {
        public readonly bool[] Expressions;
        public readonly bool[] Late;
        public readonly bool[] Joints;
        public bool Root;

        public PoseMask(AvatarPose pose) {
            Expressions = new bool[pose.ExpressionWeights.Length];
            Late = new bool[pose.LateWeights.Length];
            Joints = new bool[pose.JointDelta.Length / 16];
        }

        public void Clear() {
            System.Array.Clear(Expressions, 0, Expressions.Length);
            System.Array.Clear(Late, 0, Late.Length);
            System.Array.Clear(Joints, 0, Joints.Length);
            Root = false;
        }

        /// <summary>Copies the weights that are set.</summary>
        public void CopyWeights(AvatarPose from, AvatarPose to) {
            for (int i = 0; i < Expressions.Length; i++) {
                if (Expressions[i]) to.ExpressionWeights[i] = from.ExpressionWeights[i];
            }
            for (int i = 0; i < Late.Length; i++) {
                if (Late[i]) to.LateWeights[i] = from.LateWeights[i];
            }
        }

        /// <summary>Copies the joints that are set, and the movement of the whole.</summary>
        public void CopyJoints(AvatarPose from, AvatarPose to) {
            for (int i = 0; i < Joints.Length; i++) {
                if (Joints[i]) System.Array.Copy(from.JointDelta, 16 * i, to.JointDelta, 16 * i, 16);
            }
            if (Root) System.Array.Copy(from.WorldFromAvatar, to.WorldFromAvatar, 16);
        }
    }
}
