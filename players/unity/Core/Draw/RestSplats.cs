using System;

namespace AvatarExport.Core
{
    /// <summary>
    /// The Gaussians of one level in the pose in which they were bound, computed on the CPU: for still pictures, not for
    /// frames. Expressions, joints and colours that depend on the direction of view are left out.
    /// </summary>
    public sealed class RestSplats
    {
        private const double Tiny = 1e-30; // as AVATAR_TINY of bind.hlsli
        private static readonly double FirstHarmonic = 0.5 / Math.Sqrt(Math.PI); // degree 0, the same in all directions

        /// <summary>Centres, [N, 3], metres.</summary>
        public double[] Mean;

        /// <summary>Covariances xx, xy, xz, yy, yz, zz, [N, 6], square metres.</summary>
        public double[] Covariance;

        /// <summary>Colours, [N, 3], display-referred, from 0.</summary>
        public double[] Colour;

        /// <summary>Opacities, [N], 0 to 1.</summary>
        public double[] Opacity;

        private readonly Avatar avatar;
        private readonly Level level;
        private readonly double[] quaternion = new double[4]; // wxyz
        private readonly double[] position = new double[3];
        private readonly double[] rotation = new double[9]; // row-major
        private readonly double[] local = new double[9];

        private RestSplats(Avatar avatar, int index)
        {
            this.avatar = avatar;
            level = avatar.Program.Levels[index];
            int count = avatar.Levels[index].Count;
            Mean = new double[3 * count];
            Covariance = new double[6 * count];
            Colour = new double[3 * count];
            Opacity = new double[count];
        }

        /// <summary>The Gaussians of level `index` of a pack that was read, so all its indices have been checked.</summary>
        public static RestSplats Of(Avatar avatar, int index)
        {
            var splats = new RestSplats(avatar, index);
            for (int chunk = 0; chunk < splats.level.Chunks.Length; chunk++) splats.ReadChunk(chunk);
            return splats;
        }

        private void ReadChunk(int chunk)
        {
            string splats = level.Prefix + "Splats." + chunk;
            Pass blend = PassThatWrites("blend", splats);
            if (blend == null) return;
            int first = level.Chunks[chunk].First, rows = PackedPlanes.Number(blend, "count");
            var words = new PackedWords(avatar.Program.Buffers[blend.Buffers["BlendStatic"]]);
            var mean = new PackedPlanes(words, blend, "base_mean", rows);
            var quat = new PackedPlanes(words, blend, "base_quat", rows);
            var logScale = new PackedPlanes(words, blend, "base_log_scale", rows);
            var opacity = new PackedPlanes(words, blend, "base_opacity", rows, "_table");
            var sh = new PackedPlanes(words, blend, "base_sh", rows);
            Pass bind = PassThatWrites("bind_surface", splats);
            RestSurface surface = bind == null ? null : RestSurface.Of(avatar, level, bind);
            for (int row = 0; row < rows; row++)
            {
                for (int i = 0; i < 3; i++) position[i] = mean.Linear(i, row);
                for (int i = 0; i < 4; i++) quaternion[i] = quat.Linear(i, row);
                if (surface != null) surface.Place(row, position, quaternion);
                int at = first + row;
                Array.Copy(position, 0, Mean, 3 * at, 3);
                SetCovariance(at, surface?.Turn, logScale.Linear(0, row), logScale.Linear(1, row), logScale.Linear(2, row));
                Opacity[at] = 1 / (1 + Math.Exp(-opacity.Table(row)));
                for (int i = 0; i < 3; i++) Colour[3 * at + i] = Math.Max(0, 0.5 + FirstHarmonic * sh.Linear(i, row));
            }
        }

        /// <summary>The pass of an entry that writes a buffer; null if there is none.</summary>
        private Pass PassThatWrites(string entry, string splats)
        {
            foreach (Pass pass in level.Deform)
            {
                if (pass.Entry == entry && pass.Buffers["Splats"] == splats) return pass;
            }
            return null;
        }

        /// <summary>R diag(scale^2) R^T, where R is the rotation by `quaternion`, then by `turn`.</summary>
        private void SetCovariance(int at, double[] turn, double x, double y, double z)
        {
            SetRotation();
            if (turn != null)
            {
                Array.Copy(rotation, local, 9);
                for (int i = 0; i < 9; i++)
                {
                    int r = 3 * (i / 3), c = i % 3;
                    rotation[i] = turn[r] * local[c] + turn[r + 1] * local[3 + c] + turn[r + 2] * local[6 + c];
                }
            }
            double sx = Math.Exp(2 * x), sy = Math.Exp(2 * y), sz = Math.Exp(2 * z);
            int o = 6 * at;
            for (int r = 0; r < 3; r++)
            {
                for (int c = r; c < 3; c++)
                {
                    int a = 3 * r, b = 3 * c;
                    Covariance[o++] = rotation[a] * rotation[b] * sx + rotation[a + 1] * rotation[b + 1] * sy
                        + rotation[a + 2] * rotation[b + 2] * sz;
                }
            }
        }

        private void SetRotation()
        {
            double length = 0;
            for (int i = 0; i < 4; i++) length += quaternion[i] * quaternion[i];
            length = Math.Max(Math.Sqrt(length), Tiny);
            double a = quaternion[0] / length, b = quaternion[1] / length;
            double c = quaternion[2] / length, d = quaternion[3] / length;
            rotation[0] = 1 - 2 * (c * c + d * d);
            rotation[1] = 2 * (b * c - a * d);
            rotation[2] = 2 * (b * d + a * c);
            rotation[3] = 2 * (b * c + a * d);
            rotation[4] = 1 - 2 * (b * b + d * d);
            rotation[5] = 2 * (c * d - a * b);
            rotation[6] = 2 * (b * d - a * c);
            rotation[7] = 2 * (c * d + a * b);
            rotation[8] = 1 - 2 * (b * b + c * c);
        }
    }
}
