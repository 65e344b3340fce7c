using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>
    /// Places of the eyeLook weights of one eye, by where it looks to; left and right are the subject's.
    /// </summary>
    internal sealed class EyeLook {
        public readonly int Right;
        public readonly int Left;
        public readonly int Up;
        public readonly int Down;

        public EyeLook(string side, string right, string left) {
            Right = Array.IndexOf(Arkit.Names, "eyeLook" + right + side);
            Left = Array.IndexOf(Arkit.Names, "eyeLook" + left + side);
            Up = Array.IndexOf(Arkit.Names, "eyeLookUp" + side);
            Down = Array.IndexOf(Arkit.Names, "eyeLookDown" + side);
        }
    }

    /// <summary>A weight that an output of the driving matrix gives.</summary>
    internal sealed class DrivenWeight {
        public int Row; // of the matrix
        public bool Late;
        public int Column; // of the pose's weights
        public double Low = double.NegativeInfinity;
        public double High = double.PositiveInfinity;

        /// <summary>All weights that outputs give, within their ranges if asked for.</summary>
        public static DrivenWeight[] Of(LoadedAvatar avatar, bool withinRange) {
            var found = new List<DrivenWeight>();
            PoseNames names = PoseNames.Of(avatar);
            for (int row = 0; row < avatar.Driving.Outputs.Length; row++) {
                string output = avatar.Driving.Outputs[row];
                int slash = output.IndexOf('/');
                string kind = output.Substring(0, slash), name = output.Substring(slash + 1);
                if (kind == "expression") {
                    int column = names.Expressions[name];
                    var weight = new DrivenWeight { Row = row, Column = column };
                    if (withinRange) weight.Limit(avatar.Expressions[column].Low, avatar.Expressions[column].High);
                    found.Add(weight);
                } else if (kind == "eyelid") {
                    var weight = new DrivenWeight { Row = row, Late = true, Column = names.Eyelids[name] };
                    if (withinRange) weight.Limit(0, 1);
                    found.Add(weight);
                }
            }
            return found.ToArray();
        }

        private void Limit(double low, double high) {
            Low = low;
            High = high;
        }
    }

    /// <summary>A joint that driving turns.</summary>
    internal sealed class DrivenJoint {
        private const double MostCondition = 1e6; // of the linear part of a joint's rest transform

        public string Name;
        public int Joint;
        public bool FromMatrix;
        public int[] Rows; // of the matrix, for the axes x, y, z; -1: none
        public double[] Rest; // [3, 4] linear part of mesh_from_joint at rest
        public double[] Inverse;

        /// <summary>
        /// The joints that the matrix, the head or the eyes turn. Throws AvatarError if any joint cannot turn.
        /// </summary>
        public static DrivenJoint[] Of(string owner, Skeleton skeleton, Driving driving) {
            double[] rest = RestPose.Linear(skeleton.Parents, RestPose.Rows(skeleton.RestLocal));
            Dictionary<string, int> rows = PoseNames.Places(driving.Outputs);
            var found = new List<DrivenJoint>();
            for (int joint = 0; joint < skeleton.Names.Length; joint++) {
                string name = skeleton.Names[joint];
                var one = new DrivenJoint { Name = name, Joint = joint, Rest = new double[12], Inverse = new double[12] };
                Array.Copy(rest, 12 * joint, one.Rest, 0, 12);
                if (!(Condition(one.Rest) < MostCondition)) {
                    throw new AvatarError("has a singular rest transform, so it cannot turn", owner, "joint " + name);
                }
                one.Rows = Array.ConvertAll(new[] { "x", "y", "z" }, axis => {
                    int row;
                    return rows.TryGetValue($"joint/{name}/{axis}", out row) ? row : -1;
                });
                one.FromMatrix = Array.Exists(one.Rows, row => row >= 0);
                bool measured = name == driving.HeadJoint || name == driving.LeftEyeJoint || name == driving.RightEyeJoint;
                if (!one.FromMatrix && !measured) continue;
                Affine.InvertLinear(one.Inverse, 0, one.Rest, 0);
                found.Add(one);
            }
            return found.ToArray();
        }

        /// <summary>The ratio of the largest and the least singular value of a 3x3 part, rows four apart.</summary>
        private static double Condition(double[] m) {
            var square = new double[9];
            for (int i = 0; i < 9; i++) {
                for (int k = 0; k < 12; k += 4) square[i] += m[k + i / 3] * m[k + i % 3];
            }
            int largest = Eigen.Solve(square, new double[9], 3);
            double least = Math.Min(square[0], Math.Min(square[4], square[8]));
            return Math.Sqrt(square[4 * largest] / Math.Max(least, 0));
        }
    }
}
