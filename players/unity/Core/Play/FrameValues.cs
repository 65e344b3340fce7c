using System;

namespace AvatarExport.Core {
    /// <summary>
    /// The values of one frame that passes ask for by name, for one avatar. Its methods allocate nothing.
    /// </summary>
    public sealed class FrameValues {
        /// <summary>Where each value lies in Floats.</summary>
        public readonly FrameLayout Layout;

        /// <summary>All values.</summary>
        public readonly float[] Floats;

        private readonly int groups;
        private readonly double[] view = new double[16]; // camera from avatar
        private readonly double[] clip = new double[16];
        private readonly double[] eye = new double[3];
        private readonly double[] quat = new double[4];

        // First float of each row: names that are made in a frame would be new strings.
        private readonly int[] worldRows;
        private readonly int[] cameraRows;
        private readonly int[] clipRows;
        private readonly int[] matrixRows;
        private readonly int[] rotationRows;
        private readonly int worldQuat;
        private readonly int eyeAt;
        private readonly int tanAt;
        private readonly int sizeAt;
        private readonly int lightAt;

        /// <summary>Values for an avatar of that many groups; they are 0.</summary>
        public FrameValues(int groups) {
            this.groups = groups;
            Layout = new FrameLayout(groups);
            Floats = new float[Layout.Size];
            worldRows = Rows("world", 3);
            cameraRows = Rows("camera", 3);
            clipRows = Rows("clip", 4);
            matrixRows = Rows("group_matrix", 3);
            rotationRows = Rows("group_rotation", 3);
            worldQuat = Layout.First("world_quat_wxyz");
            eyeAt = Layout.First("eye");
            tanAt = Layout.First("tan_half_fov");
            sizeAt = Layout.First("image_size");
            lightAt = Layout.First("light_ambient0");
        }

        /// <summary>Takes the results of stage joints.</summary>
        public void SetPosed(Posed posed) {
            SetWorld(posed.WorldFromAvatar);
            for (int row = 0; row < 3; row++) {
                SetTable(matrixRows[row], posed.GroupMatrix, row);
                SetTable(rotationRows[row], posed.GroupRotation, row);
            }
        }

        /// <summary>The world matrix [4, 4] alone.</summary>
        public void SetWorld(double[] worldFromAvatar) {
            for (int row = 0; row < 3; row++) SetRow(worldRows[row], worldFromAvatar, row);
            Affine.QuatFromMatrix(quat, 0, worldFromAvatar, 0);
            for (int i = 0; i < 4; i++) Floats[worldQuat + i] = (float)quat[i];
        }

        /// <summary>
        /// Takes the camera, seen from the pack's own space: "place" [4, 4] row-major puts the pack into the scene.
        /// Any affine matrix will do, also one that scales or mirrors. A singular matrix draws nothing: every Gaussian
        /// is at depth 0.
        /// </summary>
        public void SetCamera(AvatarCamera camera, double[] place) {
            Affine.Multiply4(view, camera.CameraFromWorld, place);
            Affine.Multiply4(clip, camera.ClipFromWorld, place);
            if (!Solve(place, camera.Centre, eye)) Array.Clear(view, 0, view.Length);
            for (int row = 0; row < 3; row++) SetRow(cameraRows[row], view, row);
            for (int row = 0; row < 4; row++) SetRow(clipRows[row], clip, row);
            for (int i = 0; i < 3; i++) Floats[eyeAt + i] = (float)eye[i];
            Floats[eyeAt + 3] = 1;
            Floats[tanAt] = camera.TanHalfFov[0];
            Floats[tanAt + 1] = camera.TanHalfFov[1];
            Floats[sizeAt] = camera.Width;
            Floats[sizeAt + 1] = camera.Height;
        }

        /// <summary>Takes the light of the scene.</summary>
        public void SetLight(LightRows light) => Array.Copy(light.Floats, 0, Floats, lightAt, LightRows.Count);

        private int[] Rows(string name, int count) {
            var found = new int[count];
            for (int row = 0; row < count; row++) found[row] = Layout.First(name + "_row" + row);
            return found;
        }

        private void SetRow(int at, double[] matrix, int row) {
            for (int c = 0; c < 4; c++) Floats[at + c] = (float)matrix[4 * row + c];
        }

        /// <summary>Row "row" of each [3, 4] of a table by group.</summary>
        private void SetTable(int at, float[] table, int row) {
            for (int g = 0; g < groups; g++) Array.Copy(table, 12 * g + 4 * row, Floats, at + 4 * g, 4);
        }

        /// <summary>The point whose image under the affine matrix m is "point"; false if m is singular.</summary>
        private static bool Solve(double[] m, float[] point, double[] result) {
            double a = m[0], b = m[1], c = m[2], d = m[4], e = m[5], f = m[6], g = m[8], h = m[9], i = m[10];
            double x = point[0] - m[3], y = point[1] - m[7], z = point[2] - m[11];
            double ei = e * i - f * h, fg = f * g - d * i, dh = d * h - e * g;
            double determinant = a * ei + b * fg + c * dh;
            if (!(Math.Abs(determinant) > 0) || double.IsInfinity(determinant)) return false;
            result[0] = (x * ei + y * (c * h - b * i) + z * (b * f - c * e)) / determinant;
            result[1] = (x * fg + y * (a * i - c * g) + z * (c * d - a * f)) / determinant;
            result[2] = (x * dh + y * (b * g - a * h) + z * (a * e - b * d)) / determinant;
            return true;
        }
    }
}
