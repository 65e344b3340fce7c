using System;

namespace AvatarExport.Core {
    /// <summary>Makes poses of one avatar from captured frames: ARKit weights, rotations of head and eyes.</summary>
    public sealed class Driver {

        private static readonly double[] HeadSigns = { 1, -1, 1 }; // of yaw, pitch, roll about +Y, +X, +Z
        private static readonly double[] EyeSigns = { -1, 1, -1 };
        private static readonly double[] Mirror = { -1, 1, -1 }; // of the same angles in a left-handed frame
        private static readonly EyeLook LookLeft = new EyeLook("Left", "In", "Out");
        private static readonly EyeLook LookRight = new EyeLook("Right", "Out", "In");

        private readonly Driving driving;
        private readonly int[] columns; // input -> place in Arkit.Names; -1: it stays 0
        private readonly double[] values; // [outputs]
        private readonly DrivenWeight[] weights;
        private readonly DrivenJoint[] turns;
        private readonly DrivenJoint head; // or null, as the eyes
        private readonly DrivenJoint leftEye;
        private readonly DrivenJoint rightEye;
        private readonly double[] rotation = new double[12]; // the rotation in hand, rows four apart
        private readonly double[] made = new double[12];
        private readonly double[] angles = new double[3];
        private readonly bool mirrored;

        /// <summary>
        /// A driver of an avatar. "withinRange" limits each expression to its trained range and each eyelid to 0..1; by
        /// default weights are used as they come. Throws AvatarError if ARKit cannot drive this avatar, and for a joint
        /// that cannot turn.
        /// </summary>
        public Driver(LoadedAvatar avatar, bool withinRange = false) {
            driving = avatar.Driving;
            if (driving == null) {
                string message = "ARKit weights cannot drive this avatar: no mapping from the 52 ARKit names is known";
                throw new AvatarError(message, avatar.Name, "driving");
            }
            mirrored = avatar.Handedness == "left";
            columns = Array.ConvertAll(driving.Inputs, name => Array.IndexOf(Arkit.Names, name));
            values = new double[driving.Outputs.Length];
            weights = DrivenWeight.Of(avatar, withinRange);
            turns = avatar.Skeleton == null ? new DrivenJoint[0] : DrivenJoint.Of(avatar.Name, avatar.Skeleton, driving);
            head = Array.Find(turns, one => one.Name == driving.HeadJoint);
            leftEye = Array.Find(turns, one => one.Name == driving.LeftEyeJoint);
            rightEye = Array.Find(turns, one => one.Name == driving.RightEyeJoint);
        }

        /// <summary>
        /// Writes the pose of a frame into "into", a pose of this avatar. What the frame does not move is at rest.
        /// Allocates nothing.
        /// </summary>
        public void Pose(DrivingFrame frame, AvatarPose into) {
            into.Reset();
            Multiply(frame.Weights);
            for (int i = 0; i < weights.Length; i++) {
                DrivenWeight one = weights[i];
                double weight = Math.Min(Math.Max(values[one.Row], one.Low), one.High);
                (one.Late ? into.LateWeights : into.ExpressionWeights)[one.Column] = (float)weight;
            }
            for (int i = 0; i < turns.Length; i++) TurnJoint(turns[i], frame, into);
            if (head == null) TurnWhole(frame, into);
        }

        private void Multiply(float[] given) {
            double[] matrix = driving.Matrix;
            int inputs = columns.Length;
            for (int row = 0; row < values.Length; row++) {
                double sum = 0;
                for (int i = 0; i < inputs; i++) {
                    sum += columns[i] < 0 ? 0 : matrix[row * inputs + i] * given[columns[i]];
                }
                values[row] = sum;
            }
        }

        /// <summary>The delta B^-1 R B of a joint with the rotation R that matrix, eyes and head give it.</summary>
        private void TurnJoint(DrivenJoint turn, DrivingFrame frame, AvatarPose into) {
            bool turned = turn.FromMatrix;
            if (turned) {
                for (int axis = 0; axis < 3; axis++) angles[axis] = turn.Rows[axis] < 0 ? 0 : values[turn.Rows[axis]];
                Affine.SetRotation(rotation, 0, angles[0], angles[1], angles[2]);
            }
            if (turn == leftEye) turned = TurnEye(frame.RightEye, frame.Weights, LookLeft, turned);
            if (turn == rightEye) turned = TurnEye(frame.LeftEye, frame.Weights, LookRight, turned);
            if (turn == head) {
                SetEuler(turned ? made : rotation, frame.Head, HeadSigns);
                if (turned) Affine.MultiplyLinear(rotation, 0, made, 0, rotation, 0);
            }
            Affine.MultiplyLinear(rotation, 0, rotation, 0, turn.Rest, 0);
            Affine.MultiplyLinear(into.JointDelta, 16 * turn.Joint, turn.Inverse, 0, rotation, 0);
        }

        /// <summary>
        /// A measured eye replaces what turned it; one that nothing turned follows the weights. The result is true.
        /// </summary>
        private bool TurnEye(double[] measured, float[] given, EyeLook look, bool turned) {
            if (measured[0] != 0 || measured[1] != 0 || measured[2] != 0) {
                SetEuler(rotation, measured, EyeSigns);
            } else if (!turned) {
                angles[0] = Arkit.RadiansPerEyeWeight * ((double)given[look.Right] - given[look.Left]);
                angles[1] = Arkit.RadiansPerEyeWeight * ((double)given[look.Down] - given[look.Up]);
                angles[2] = 0;
                SetEuler(rotation, angles, EyeSigns);
            }
            return true;
        }

        /// <summary>The whole avatar turns about the head's pivot: X = T(p) H T(-p).</summary>
        private void TurnWhole(DrivingFrame frame, AvatarPose into) {
            double[] m = into.WorldFromAvatar, p = driving.HeadPivot;
            SetEuler(m, frame.Head, HeadSigns);
            for (int i = 0; i < 3; i++) {
                m[4 * i + 3] = p[i] - m[4 * i] * p[0] - m[4 * i + 1] * p[1] - m[4 * i + 2] * p[2];
            }
        }

        /// <summary>Ry Rx Rz of signed angles (yaw, pitch, roll), in the frame of the avatar.</summary>
        private void SetEuler(double[] into, double[] turned, double[] signs) {
            double a = turned[0] * signs[0] * (mirrored ? Mirror[0] : 1) / 2;
            double b = turned[1] * signs[1] * (mirrored ? Mirror[1] : 1) / 2;
            double c = turned[2] * signs[2] * (mirrored ? Mirror[2] : 1) / 2;
            double ca = Math.Cos(a), sa = Math.Sin(a), cb = Math.Cos(b), sb = Math.Sin(b), cc = Math.Cos(c), sc = Math.Sin(c);
            double w = ca * cb * cc + sa * sb * sc; // of Ry(2a) Rx(2b) Rz(2c)
            double x = ca * sb * cc + sa * cb * sc;
            double y = sa * cb * cc - ca * sb * sc;
            double z = ca * cb * sc - sa * sb * cc;
            Affine.SetFromQuat(into, 0, w, x, y, z);
        }
    }
}
