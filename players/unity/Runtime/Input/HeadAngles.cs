using System;
using UnityEngine;

namespace AvatarExport {
    /// <summary>The rotation of a head as the angles of a DrivingFrame.</summary>
    public static class HeadAngles {
        /// <summary>
        /// Writes yaw, pitch and roll [3], radians, of a face that ARFoundation turned against its camera. Unity's z of
        /// an ARKit object is ARKit's -z; so in ARKit's frame, where a face looks along +z, x and y of the quaternion
        /// are negated.
        /// </summary>
        public static void Write(Quaternion turn, double[] into) {
            double x = -turn.x, y = -turn.y, z = turn.z, w = turn.w;
            // Ry(yaw) Rx(-pitch) Rz(roll): elements of its matrix, row and column.
            double r02 = 2 * (x * z + w * y), r22 = 1 - 2 * (x * x + y * y);
            double r12 = 2 * (y * z - w * x), r10 = 2 * (x * y + w * z), r11 = 1 - 2 * (x * x + z * z);
            into[0] = Math.Atan2(r02, r22);
            into[1] = Math.Asin(Math.Max(-1, Math.Min(1, r12)));
            into[2] = Math.Atan2(r10, r11);
        }
    }
}
