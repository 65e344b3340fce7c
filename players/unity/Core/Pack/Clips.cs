using System;
using System.Collections.Generic;
using System.Linq;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>
    /// Recorded motions: float32, or by channel low + step * code with codes as differences from frame to frame.
    /// </summary>
    internal sealed class Clips {
        private const double Rigid = 1e-3; // largest difference of R R^T from the identity

        private readonly Dictionary<string, HeldArray> arrays;
        private readonly long limit;
        private long left;

        private Clips(Dictionary<string, HeldArray> arrays, long limit) {
            this.arrays = arrays;
            this.limit = limit;
            left = limit;
        }

        /// <summary>
        /// The clips of a document for so many expressions, late morphs and joints; all of them together take at most
        /// `limit` bytes. Throws AvatarError.
        /// </summary>
        public static Clip[] Read(
            Json listed, Dictionary<string, HeldArray> arrays, int expressions, int late, int joints, long limit) {
            Clips clips = new Clips(arrays, limit);
            return listed.List().Select((said, index) => clips.Read(said, index, expressions, late, joints)).ToArray();
        }

        private Clip Read(Json said, int index, int expressions, int late, int joints) {
            int frames = said.At("frames").Int();
            string key = Invariant($"clips.{index}.");
            Clip clip = new Clip {
                Name = said.At("name").Text(),
                Fps = said.At("fps").Number(),
                Frames = frames,
                ExpressionWeights = ReadArray(said, key + "expression_weights", frames, expressions),
                LateWeights = ReadArray(said, key + "late_weights", frames, late),
                JointDelta = ReadArray(said, key + "joint_delta", frames, joints, 4, 4),
                WorldFromAvatar = ReadArray(said, key + "world_from_avatar", frames, 4, 4),
            };
            CheckMatrices(clip, said.Path);
            return clip;
        }

        private float[] ReadArray(Json said, string key, params long[] shape) {
            long channels = shape.Skip(1).Aggregate(1L, (product, length) => product * length);
            left -= 4 * shape[0] * channels;
            if (left < 0) {
                throw new AvatarError(Invariant($"with it the clips take more than {limit} bytes"), null, said.Path);
            }
            float[] values = Stored(key, shape, (int)channels);
            Rig.CheckFinite(values, "array " + key);
            return values;
        }

        private float[] Stored(string key, long[] shape, int channels) {
            HeldArray whole;
            if (!arrays.TryGetValue(key, out whole)) return Decoded(key, (int)shape[0], channels);
            if (!whole.Is("f32", shape)) {
                string line = "has shape " + Rig.Shown(whole.Shape) + ", not " + Rig.Shown(shape);
                throw new AvatarError(line, null, "array " + key);
            }
            return whole.Elements.Copied<float>();
        }

        private float[] Decoded(string key, int frames, int channels) {
            float[] scale = Taken(key + ".scale", "f32", "float32", channels, 2).Copied<float>();
            int[] moves = Enumerable.Range(0, channels).Where(channel => scale[2 * channel + 1] != 0).ToArray();
            Elements codes = Taken(key + ".codes", "u16", "uint16", moves.Length, frames);
            float[] values = new float[(long)frames * channels];
            for (int at = 0; at < values.Length; at++) values[at] = scale[2 * (at % channels)];
            for (int row = 0; row < moves.Length; row++) {
                int channel = moves[row];
                double low = scale[2 * channel];
                double step = scale[2 * channel + 1];
                ushort code = 0;
                for (int frame = 0; frame < frames; frame++) {
                    code = unchecked((ushort)(code + codes[row * frames + frame]));
                    values[frame * channels + channel] = (float)(low + (float)(code * step));
                }
            }
            return values;
        }

        private Elements Taken(string key, string type, string typeName, long rows, long columns) {
            HeldArray held;
            if (arrays.TryGetValue(key, out held) && held.Is(type, rows, columns)) return held.Elements;
            throw new AvatarError(Invariant($"is missing, or is not {typeName} [{rows}, {columns}]"), null, "array " + key);
        }

        private static void CheckMatrices(Clip clip, string field) {
            foreach (float[] matrices in new[] { clip.JointDelta, clip.WorldFromAvatar }) {
                for (int at = 0; at < matrices.Length; at += 16) {
                    if (!Rig.HasAffineRow(matrices, at)) {
                        throw new AvatarError("holds a matrix that is not affine", null, field);
                    }
                }
            }
            for (int at = 0; at < clip.WorldFromAvatar.Length; at += 16) {
                if (IsRigid(clip.WorldFromAvatar, at)) continue;
                string line = Invariant($"world_from_avatar of frame {at / 16} is not rigid: ");
                throw new AvatarError(line + "a rotation and a translation move the avatar as a whole", null, field);
            }
        }

        private static bool IsRigid(float[] m, int at) {
            double off = 0;
            for (int i = 0; i < 3; i++) {
                for (int j = 0; j < 3; j++) {
                    double dot = i == j ? -1 : 0;
                    for (int k = 0; k < 3; k++) dot += (double)m[at + 4 * i + k] * m[at + 4 * j + k];
                    off = Math.Max(off, Math.Abs(dot));
                }
            }
            return off <= Rigid && Rig.Volume(m, at) > 0;
        }
    }
}
