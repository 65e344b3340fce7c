using System;
using System.Diagnostics;
using System.Globalization;
using System.IO;
using AvatarExport.Core;

namespace AvatarExport.Bench {
    /// <summary>
    /// CPU time of a pose: "PoseSpeed.exe PACK" prints a line of a name and milliseconds for each part.
    /// </summary>
    internal static class PoseSpeed {
        private const int Turns = 4000;
        private const int Rounds = 5;

        private static void Main(string[] arguments) {
            LoadedAvatar avatar = LoadedAvatar.Load(File.ReadAllBytes(arguments[0]), arguments[0]);
            var instance = new Instance(avatar, 0);
            var driver = new Driver(avatar);
            var frame = new DrivingFrame();
            var frames = new BoneFrames(avatar);
            var bones = new Bones(avatar.Skeleton.Names.Length);
            var random = new Random(1);
            for (int i = 0; i < frame.Weights.Length; i++) frame.Weights[i] = (float)random.NextDouble();
            for (int i = 0; i < 3; i++) frame.Head[i] = 0.1;
            Show("drive", i => driver.Pose(frame, instance.Pose));
            foreach (string joint in avatar.Skeleton.Names) {
                instance.Pose.SetJoint(joint, random.NextDouble() - 0.5, 0.1, 0);
            }
            Show("joints", i => {
                for (int k = 0; k < instance.Pose.ExpressionWeights.Length; k++) {
                    instance.Pose.ExpressionWeights[k] = 0.1f + 1e-5f * i;
                }
                instance.UpdatePose();
            });
            Show("pose_to_bones", i => frames.ToBones(instance.Pose, bones));
            Show("bones_to_pose", i => frames.FromBones(bones, instance.Pose));
        }

        /// <summary>The median of several rounds.</summary>
        private static void Show(string name, Action<int> run) {
            var times = new double[Rounds];
            for (int round = -1; round < Rounds; round++) {
                double begin = Process.GetCurrentProcess().TotalProcessorTime.TotalMilliseconds;
                for (int i = 0; i < Turns; i++) run(i);
                double took = Process.GetCurrentProcess().TotalProcessorTime.TotalMilliseconds - begin;
                if (round >= 0) times[round] = took / Turns; // the first round compiles
            }
            Array.Sort(times);
            Console.WriteLine(name + " " + times[Rounds / 2].ToString("R", CultureInfo.InvariantCulture));
        }
    }
}
