using System;

namespace AvatarExport.Core {
    /// <summary>
    /// The Gaussians of one level in the pose in which they were bound, computed on the CPU: for still pictures, not for
    /// frames. Expressions, joints and colours that depend on the direction of view are left out.
    /// </summary>
    public sealed class RestSplats {
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

        private readonly LoadedAvatar avatar;
        private readonly Level level;
        private readonly double[] quaternion = new double[4]; // wxyz
        private readonly double[] position = new double[3];
        private readonly double[] rotation = new double[12]; // rows four apart

        private RestSplats(LoadedAvatar avatar, int index) {
            this.avatar = avatar;
            level = avatar.Program.Levels[index];
            int count = avatar.Levels[index].Count;
            Mean = new double[3 * count];
            Covariance = new double[6 * count];
            Colour = new double[3 * count];
            Opacity = new double[count];
        }

        /// <summary>The Gaussians of level `index` of a pack that was read, so all its indices have been checked.</summary>
        public static RestSplats Of(LoadedAvatar avatar, int index) {
            var splats = new RestSplats(avatar, index);
            for (int chunk = 0; chunk < splats.level.Chunks.Length; chunk++) splats.ReadChunk(chunk);
            return splats;
        }

        private void ReadChunk(int chunk) {
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
            for (int row = 0; row < rows; row++) {
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
        private Pass PassThatWrites(string entry, string splats) {
            foreach (Pass pass in level.Deform) {
                if (pass.Entry == entry && pass.Buffers["Splats"] == splats) return pass;
            }
            return null;
        }

        /// <summary>R diag(scale^2) R^T, where R is the rotation by `quaternion`, then by `turn`.</summary>
        private void SetCovariance(int at, double[] turn, double x, double y, double z) {
            double length = 0;
            for (int i = 0; i < 4; i++) length += quaternion[i] * quaternion[i];
            length = Math.Max(Math.Sqrt(length), Tiny);
            for (int i = 0; i < 4; i++) quaternion[i] /= length;
            double[] r = rotation;
            Affine.SetFromQuat(r, 0, quaternion[0], quaternion[1], quaternion[2], quaternion[3]);
            if (turn != null) Affine.MultiplyLinear(r, 0, turn, 0, r, 0);
            double sx = Math.Exp(2 * x), sy = Math.Exp(2 * y), sz = Math.Exp(2 * z);
            int o = 6 * at;
            for (int a = 0; a < 12; a += 4) {
                for (int b = a; b < 12; b += 4) {
                    Covariance[o++] = r[a] * r[b] * sx + r[a + 1] * r[b + 1] * sy + r[a + 2] * r[b + 2] * sz;
                }
            }
        }
    }
}
