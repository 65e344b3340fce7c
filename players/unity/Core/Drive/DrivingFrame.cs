using System;

namespace AvatarExport.Core {
    /// <summary>A captured frame of a face, to be written again and again. A new one is of zeros.</summary>
    public sealed class DrivingFrame {
        /// <summary>Weights [52], in the order of Arkit.Names. They may lie below 0 or above 1.</summary>
        public readonly float[] Weights = new float[Arkit.Names.Length];

        /// <summary>Yaw, pitch and roll of the head, radians, [3].</summary>
        public readonly double[] Head = new double[3];

        /// <summary>
        /// Yaw, pitch and roll of the recorder's channels leftEye*, radians, [3]: the subject's right eye.
        /// </summary>
        public readonly double[] LeftEye = new double[3];

        /// <summary>Those of the channels rightEye*, [3]: the subject's left eye.</summary>
        public readonly double[] RightEye = new double[3];

        /// <summary>Takes 61 channels, in the order of Arkit.Channels, that begin at channels[at].</summary>
        public void SetChannels(double[] channels, int at) {
            int shapes = Weights.Length;
            for (int i = 0; i < shapes; i++) Weights[i] = (float)channels[at + i];
            Array.Copy(channels, at + shapes, Head, 0, 3);
            Array.Copy(channels, at + shapes + 3, LeftEye, 0, 3);
            Array.Copy(channels, at + shapes + 6, RightEye, 0, 3);
        }
    }
}
