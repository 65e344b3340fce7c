using System;
using AvatarExport.Core;
using UnityEngine;

namespace AvatarExport {
    /// <summary>
    /// Unity's camera as that of Core. Unity looks along -z with y up; Core looks along +z with y down.
    /// </summary>
    internal sealed class CameraMatrices {
        private readonly float[] cameraFromWorld = new float[16];
        private readonly float[] clipFromWorld = new float[16];
        private readonly float[] centre = new float[3];
        private readonly float[] tanHalfFov = new float[2];

        /// <summary>Whether an avatar can be drawn with a projection: one with perspective.</summary>
        public static bool HasPerspective(Matrix4x4 projection) => projection.m33 == 0 && projection.m32 != 0;

        /// <summary>
        /// Writes "view" (camera from world) and "projection" (depth -1..1) into a camera. Its clip z over w is what
        /// the depth buffer holds: 1 at the near plane and 0 at the far one if "reversed", else 0 and 1.
        /// </summary>
        public void Write(Matrix4x4 view, Matrix4x4 projection, bool reversed, int width, int height, AvatarCamera into) {
            Matrix4x4 clip = projection * view;
            for (int column = 0; column < 4; column++) {
                float w = clip[3, column], z = clip[2, column];
                clipFromWorld[column] = clip[0, column];
                clipFromWorld[4 + column] = -clip[1, column];
                clipFromWorld[8 + column] = 0.5f * (reversed ? w - z : w + z);
                clipFromWorld[12 + column] = w;
                cameraFromWorld[column] = view[0, column];
                cameraFromWorld[4 + column] = -view[1, column];
                cameraFromWorld[8 + column] = -view[2, column];
                cameraFromWorld[12 + column] = column == 3 ? 1 : 0;
            }
            // A view is rigid: its inverse is its transpose.
            for (int i = 0; i < 3; i++) {
                centre[i] = -(view[0, i] * view.m03 + view[1, i] * view.m13 + view[2, i] * view.m23);
            }
            tanHalfFov[0] = Math.Abs(projection.m32 / projection.m00);
            tanHalfFov[1] = Math.Abs(projection.m32 / projection.m11);
            into.SetMatrices(cameraFromWorld, clipFromWorld, centre, tanHalfFov, width, height);
        }

        /// <summary>
        /// Writes Instance.Place from an object's matrix, [4, 4] row-major. Unity is left-handed: x of the person's
        /// frame points the other way.
        /// </summary>
        public static void WritePlace(Matrix4x4 worldFromObject, double[] into) {
            for (int row = 0; row < 4; row++) {
                for (int column = 0; column < 4; column++) {
                    float value = worldFromObject[row, column];
                    into[4 * row + column] = column == 0 ? -value : value;
                }
            }
        }
    }
}
