using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>Stages driving and joints, which no GPU runs.</summary>
    internal static class CpuStages {
        /// <summary>Stage driving: a captured frame to a pose.</summary>
        public static Dictionary<string, double[]> Driving(LoadedAvatar avatar, Dictionary<string, double[]> x, bool withinRange) {
            var frame = new DrivingFrame();
            var pose = new AvatarPose(avatar);
            frame.SetChannels(x["channels"], 0);
            new Driver(avatar, withinRange).Pose(frame, pose);
            return new Dictionary<string, double[]> {
                { "expression_weights", Doubles(pose.ExpressionWeights) },
                { "late_weights", Doubles(pose.LateWeights) },
                { "joint_delta", pose.JointDelta },
                { "world_from_avatar", pose.WorldFromAvatar },
            };
        }

        /// <summary>
        /// Stage joints. It poses the anchor vertices itself where it is told the late weights; else it takes those of
        /// x.
        /// </summary>
        public static Dictionary<string, double[]> Joints(LoadedAvatar avatar, Dictionary<string, double[]> x, double[] late) {
            var pose = new AvatarPose(avatar);
            Fill(pose.ExpressionWeights, x["expression_weights"]);
            Array.Copy(x["joint_delta"], pose.JointDelta, pose.JointDelta.Length);
            double[] anchors = null;
            if (late != null) Fill(pose.LateWeights, late);
            else x.TryGetValue("anchor_vertices", out anchors);
            Posed posed = new Poser(avatar).Update(pose, anchors == null ? null : Floats(anchors));
            PoseSections at = avatar.Program.Pose;
            int joints = (avatar.Program.PoseFloats - at.Joints) / 12;
            var skin = new double[16 * joints];
            for (int j = 0; j < joints; j++) {
                for (int k = 0; k < 12; k++) skin[16 * j + k] = posed.PoseFloats[at.Joints + 12 * j + k];
                skin[16 * j + 15] = 1;
            }
            var features = new double[at.Late - at.Features];
            for (int i = 0; i < features.Length; i++) features[i] = posed.PoseFloats[at.Features + i];
            var rotation = new double[9 * avatar.Groups.Length];
            for (int i = 0; i < rotation.Length; i++) rotation[i] = posed.GroupRotation[i / 3 * 4 + i % 3];
            return new Dictionary<string, double[]> {
                { "skin_matrix", skin },
                { "pose_feature", features },
                { "group_matrix", Doubles(posed.GroupMatrix) },
                { "group_rotation", rotation },
            };
        }

        public static float[] Floats(double[] values) => Array.ConvertAll(values, one => (float)one);

        public static double[] Doubles(float[] values) => Array.ConvertAll(values, one => (double)one);

        private static void Fill(float[] into, double[] values) {
            for (int i = 0; i < into.Length; i++) into[i] = (float)values[i];
        }
    }
}
