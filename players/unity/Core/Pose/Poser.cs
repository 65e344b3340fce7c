using System;

namespace AvatarExport.Core {
    /// <summary>The small inputs of one frame: everything that a GPU receives for a pose.</summary>
    public sealed class Posed {
        /// <summary>
        /// The content of buffer Pose: weights [K], features [9 C], late weights [L], skin matrices [J, 3, 4].
        /// </summary>
        public float[] PoseFloats;

        /// <summary>Of each group, mesh from binding mesh, [G, 3, 4].</summary>
        public float[] GroupMatrix;

        /// <summary>Of each group, the rotation of its Gaussians, [G, 3, 4] with a last column of 0.</summary>
        public float[] GroupRotation;

        /// <summary>Rigid transform of the pose, [4, 4] row-major. It is the pose's own array.</summary>
        public double[] WorldFromAvatar;
    }

    /// <summary>Stage joints of one avatar, in float64 on the CPU. Update allocates nothing.</summary>
    public sealed class Poser {
        private readonly PoseSections sections;
        private readonly int[] correctives;
        private readonly Chain chain; // null without a rig
        private readonly Groups groups;
        private readonly Posed posed;

        /// <summary>The stage of an avatar.</summary>
        public Poser(LoadedAvatar avatar) {
            sections = avatar.Program.Pose;
            uint[] listed = avatar.Skeleton == null ? new uint[0] : avatar.Skeleton.CorrectiveJoints;
            correctives = Array.ConvertAll(listed, one => (int)one);
            chain = avatar.Skeleton == null ? null : new Chain(avatar.Skeleton);
            groups = new Groups(avatar);
            posed = new Posed {
                PoseFloats = new float[avatar.Program.PoseFloats],
                GroupMatrix = groups.Matrix,
                GroupRotation = groups.Rotation,
                WorldFromAvatar = new double[16],
            };
        }

        /// <summary>
        /// The inputs of a frame for a pose of this avatar: the same object and arrays every time. "anchors" [A, 3],
        /// posed anchor vertices in the order of Skeleton.AnchorVertices, replace those of the rig.
        /// </summary>
        public Posed Update(AvatarPose pose, float[] anchors = null) {
            float[] floats = posed.PoseFloats;
            Array.Copy(pose.ExpressionWeights, 0, floats, sections.Weights, pose.ExpressionWeights.Length);
            Array.Copy(pose.LateWeights, 0, floats, sections.Late, pose.LateWeights.Length);
            posed.WorldFromAvatar = pose.WorldFromAvatar;
            if (chain == null) return posed;
            SetFeatures(pose.JointDelta);
            chain.Update(pose.ExpressionWeights, pose.JointDelta);
            double[] skin = chain.Skin;
            for (int i = 0, at = sections.Joints; at < floats.Length; i++, at++) floats[at] = (float)skin[i];
            if (groups.Anchors != null) {
                if (anchors != null) groups.SetAnchors(anchors);
                else groups.Anchors.Update(floats, sections, skin);
            }
            groups.Update(skin);
            return posed;
        }

        /// <summary>Row-major R - I of the corrective joints.</summary>
        private void SetFeatures(double[] delta) {
            for (int c = 0; c < correctives.Length; c++) {
                int from = 16 * correctives[c], to = sections.Features + 9 * c;
                for (int row = 0; row < 3; row++) {
                    for (int column = 0; column < 3; column++) {
                        posed.PoseFloats[to + 3 * row + column] = (float)(delta[from + 4 * row + column] - (row == column ? 1 : 0));
                    }
                }
            }
        }
    }
}
