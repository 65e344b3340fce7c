using System;

namespace AvatarExport.Core {
    /// <summary>
    /// A pinhole camera: +x right, +y down, +z forward, pixel centres at integers. Matrices are row-major for column
    /// vectors, float32. No method allocates.
    /// </summary>
    public sealed class AvatarCamera {
        private const double Near = 0.01; // of the projection alone; each avatar decides from which depth on it is drawn
        private const double Far = 100;
        private const double Depth = Far / (Far - Near);

        /// <summary>camera from world, [4, 4].</summary>
        public readonly float[] CameraFromWorld = new float[16];

        /// <summary>clip from world, [4, 4]: y of clip space points down the image.</summary>
        public readonly float[] ClipFromWorld = new float[16];

        /// <summary>Where the camera is, world, [3].</summary>
        public readonly float[] Centre = new float[3];

        /// <summary>width / (2 fx) and height / (2 fy), [2].</summary>
        public readonly float[] TanHalfFov = new float[2];

        private static readonly double[] Origin = new double[3];

        private readonly double[] view = new double[16];
        private readonly double[] projection = new double[12]; // rows 0, 1 and 2; row 3 is 0 0 1 0
        private readonly double[] inverse = new double[12];
        private readonly double[] rotation = new double[9];
        private readonly double[] translation = new double[3];
        private readonly double[] intrinsics = new double[9];

        /// <summary>A camera that looks at the origin.</summary>
        public AvatarCamera() {
            Orbit(Origin, 1, 0, 0, Math.PI / 4, 1, 1);
        }

        /// <summary>Pixels.</summary>
        public int Width { get; private set; }

        /// <summary>Pixels.</summary>
        public int Height { get; private set; }

        /// <summary>
        /// Looks at "target" [3] (world) from a distance. "yaw" about +Y, positive towards +X, and "pitch", positive
        /// upwards, are in radians, and so is the vertical field of view. At yaw 0 the camera is before a face that
        /// looks along +Z. Throws AvatarError for an empty image.
        /// </summary>
        public void Orbit(double[] target, double distance, double yaw, double pitch, double fovY, int width, int height) {
            double sy = Math.Sin(yaw), cy = Math.Cos(yaw), sp = Math.Sin(pitch), cp = Math.Cos(pitch);
            double[] r = rotation;
            r[0] = cy; r[1] = 0; r[2] = -sy; // right
            r[3] = sp * sy; r[4] = -cp; r[5] = sp * cy; // down = forward x right
            r[6] = -sy * cp; r[7] = -sp; r[8] = -cy * cp; // forward
            double ex = target[0] + distance * sy * cp, ey = target[1] + distance * sp, ez = target[2] + distance * cy * cp;
            for (int i = 0; i < 3; i++) translation[i] = -(r[3 * i] * ex + r[3 * i + 1] * ey + r[3 * i + 2] * ez);
            Array.Clear(intrinsics, 0, 9);
            intrinsics[0] = intrinsics[4] = height / (2 * Math.Tan(fovY / 2));
            intrinsics[2] = width / 2.0;
            intrinsics[5] = height / 2.0;
            intrinsics[8] = 1;
            FromOpencv(r, translation, intrinsics, width, height);
        }

        /// <summary>
        /// x_camera = rotation x_world + translation, x_pixel = K x_camera / z - 0.5. The rotation [3, 3] and K [3, 3]
        /// are row-major, K in pixels with pixel centres at half integers. Throws AvatarError for an empty image.
        /// </summary>
        public void FromOpencv(double[] rotation, double[] translation, double[] intrinsics, int width, int height) {
            CheckSize(width, height);
            double[] k = intrinsics;
            for (int i = 0; i < 3; i++) {
                for (int j = 0; j < 3; j++) view[4 * i + j] = rotation[3 * i + j];
                view[4 * i + 3] = translation[i];
            }
            Array.Clear(projection, 0, 12);
            projection[0] = 2 * k[0] / width;
            projection[1] = 2 * k[1] / width;
            projection[2] = 2 * k[2] / width - 1;
            projection[5] = 2 * k[4] / height;
            projection[6] = 2 * k[5] / height - 1;
            TanHalfFov[0] = (float)(width / (2 * k[0]));
            TanHalfFov[1] = (float)(height / (2 * k[4]));
            Write(width, height);
        }

        /// <summary>
        /// The camera of an engine: "view" (camera from world) and "projection" [4, 4], both row-major, as OpenGL has
        /// them: y up, looking along -z. The projection's depth range does not matter. Throws AvatarError for one
        /// without perspective, and for an empty image.
        /// </summary>
        public void FromOpengl(double[] view, double[] projection, int width, int height) {
            CheckSize(width, height);
            double along = projection[14]; // clip w = along * z of the engine's camera
            if (!(Math.Abs(along) > 1e-6) || Math.Abs(projection[15]) > 1e-6) {
                throw new AvatarError("has no perspective; an orthographic camera cannot show an avatar", "the camera");
            }
            double size = Math.Abs(along), ahead = Math.Sign(along);
            for (int column = 0; column < 4; column++) {
                this.view[column] = view[column];
                this.view[4 + column] = -view[4 + column];
                this.view[8 + column] = ahead * view[8 + column];
            }
            double[] p = this.projection;
            Array.Clear(p, 0, 12);
            p[0] = projection[0] / size;
            p[1] = -projection[1] / size;
            p[2] = ahead * projection[2] / size;
            p[4] = -projection[4] / size;
            p[5] = projection[5] / size;
            p[6] = -ahead * projection[6] / size;
            TanHalfFov[0] = (float)(1 / p[0]);
            TanHalfFov[1] = (float)(1 / p[5]);
            Write(width, height);
        }

        /// <summary>
        /// Takes matrices as they are: [4, 4] row-major each, the centre [3] and the tangents [2]. Throws AvatarError
        /// for an empty image.
        /// </summary>
        public void SetMatrices(
            float[] cameraFromWorld, float[] clipFromWorld, float[] centre, float[] tanHalfFov, int width, int height) {
            CheckSize(width, height);
            Array.Copy(cameraFromWorld, CameraFromWorld, 16);
            Array.Copy(clipFromWorld, ClipFromWorld, 16);
            Array.Copy(centre, Centre, 3);
            Array.Copy(tanHalfFov, TanHalfFov, 2);
            Width = width;
            Height = height;
        }

        /// <summary>Takes over all of another camera.</summary>
        public void Copy(AvatarCamera other) {
            SetMatrices(other.CameraFromWorld, other.ClipFromWorld, other.Centre, other.TanHalfFov, other.Width, other.Height);
        }

        /// <summary>Writes everything that follows from view and projection.</summary>
        private void Write(int width, int height) {
            Width = width;
            Height = height;
            view[12] = view[13] = view[14] = 0;
            view[15] = 1;
            projection[10] = Depth;
            projection[11] = -Depth * Near;
            for (int i = 0; i < 16; i++) CameraFromWorld[i] = (float)view[i];
            for (int row = 0; row < 12; row += 4) {
                for (int column = 0; column < 4; column++) {
                    double sum = 0;
                    for (int k = 0; k < 4; k++) sum += projection[row + k] * view[4 * k + column];
                    ClipFromWorld[row + column] = (float)sum;
                }
            }
            for (int column = 0; column < 4; column++) ClipFromWorld[12 + column] = (float)view[8 + column];
            Affine.InvertLinear(inverse, 0, view, 0);
            for (int i = 0; i < 3; i++) {
                int r = 4 * i;
                Centre[i] = (float)-(inverse[r] * view[3] + inverse[r + 1] * view[7] + inverse[r + 2] * view[11]);
            }
        }

        private static void CheckSize(int width, int height) {
            if (width >= 1 && height >= 1) return;
            throw new AvatarError($"an image of {width}x{height} pixels is empty; both sizes must be at least 1", "the camera");
        }
    }
}
