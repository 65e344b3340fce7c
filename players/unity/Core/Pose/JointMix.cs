using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>A mix of joints that moves a group: M = sum_j c_j A_j + (1 - sum_j c_j) I.</summary>
    internal sealed class JointMix {
        private readonly int[] joints;
        private readonly double[] factors;
        private readonly double rest;

        public JointMix(SplatGroup group, Dictionary<string, int> places) {
            joints = new int[group.JointMix.Length];
            factors = new double[joints.Length];
            double sum = 0;
            for (int i = 0; i < joints.Length; i++) {
                joints[i] = places[group.JointMix[i].Key];
                factors[i] = group.JointMix[i].Value;
                sum += factors[i];
            }
            rest = 1 - sum;
        }

        /// <summary>M [3, 4] of skin matrices [J, 3, 4].</summary>
        public void Write(double[] result, double[] skin) {
            for (int k = 0; k < 12; k++) {
                double sum = k % 5 == 0 ? rest : 0;
                for (int i = 0; i < joints.Length; i++) sum += factors[i] * skin[12 * joints[i] + k];
                result[k] = sum;
            }
        }
    }
}
