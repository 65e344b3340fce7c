using UnityEngine;

namespace AvatarExport {
    /// <summary>Boxes in the world.</summary>
    internal static class Boxes {
        /// <summary>The box around a box that a matrix moved.</summary>
        public static Bounds Of(Matrix4x4 matrix, Bounds box) {
            Vector3 centre = matrix.MultiplyPoint3x4(box.center), half = box.extents, size = Vector3.zero;
            for (int row = 0; row < 3; row++) {
                for (int column = 0; column < 3; column++) {
                    size[row] += 2 * Mathf.Abs(matrix[row, column]) * half[column];
                }
            }
            return new Bounds(centre, size);
        }
    }

    /// <summary>Rotations and vectors.</summary>
    internal static class Turns {
        /// <summary>Axis times angle, radians, of a unit quaternion.</summary>
        public static Vector3 VectorOf(Quaternion turn) {
            float sign = turn.w < 0 ? -1 : 1;
            var axis = new Vector3(sign * turn.x, sign * turn.y, sign * turn.z);
            float sine = axis.magnitude;
            if (sine < 1e-7f) return 2 * axis;
            return axis * (2 * Mathf.Atan2(sine, sign * turn.w) / sine);
        }

        /// <summary>Three numbers of an array.</summary>
        public static Vector3 Vector(double[] from, int at) => new Vector3((float)from[at], (float)from[at + 1], (float)from[at + 2]);

        /// <summary>Four numbers of an array, as x, y, z, w.</summary>
        public static Quaternion Turn(double[] from, int at) {
            return new Quaternion((float)from[at], (float)from[at + 1], (float)from[at + 2], (float)from[at + 3]);
        }
    }

    /// <summary>Objects that are made at run time.</summary>
    internal static class Objects {
        /// <summary>Destroys one, also while a scene is edited.</summary>
        public static void Destroy(Object made) {
            if (made == null) return;
            if (Application.isPlaying) Object.Destroy(made);
            else Object.DestroyImmediate(made);
        }
    }
}
