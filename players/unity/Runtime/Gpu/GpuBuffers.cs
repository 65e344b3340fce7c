using System;
using System.Collections.Generic;
using AvatarExport.Core;
using UnityEngine;

namespace AvatarExport {
    /// <summary>Makes structured buffers, within the limits of this device.</summary>
    internal static class GpuBuffers {
        private const int Word = 4; // bytes

        /// <summary>
        /// A buffer of zeros. Throws AvatarError where it is too large for this device; "what" is told then.
        /// </summary>
        public static GraphicsBuffer Make(string owner, string what, long count, int stride) {
            long bytes = count * stride, most = SystemInfo.maxGraphicsBufferSize;
            if (bytes > most) {
                string reason = $"needs {bytes} bytes, and this device's buffers hold {most}; "
                    + "use a coarser level, or pack it smaller";
                throw new AvatarError(reason, owner, what);
            }
            var buffer = new GraphicsBuffer(GraphicsBuffer.Target.Structured, (int)Math.Max(count, 1), stride);
            buffer.SetData(new uint[Math.Max(count, 1) * stride / Word]);
            return buffer;
        }

        /// <summary>A buffer of a program, with its content if it has one. Throws AvatarError as above.</summary>
        public static GraphicsBuffer Make(string owner, ProgramBuffer described, int stride) {
            long count = (described.Bytes + stride - 1) / stride;
            GraphicsBuffer buffer = Make(owner, "buffer " + described.Name, count, stride);
            if (described.Sections.Length > 0) buffer.SetData(described.Content());
            return buffer;
        }

        /// <summary>Bytes of an element of each buffer that passes bind: what the shaders declare.</summary>
        public static Dictionary<string, int> Strides(Program program, Level level) {
            var strides = new Dictionary<string, int>();
            foreach (Pass[] passes in new[] { program.Mesh, level.Deform, level.View }) {
                foreach (Pass one in passes) {
                    foreach (StorageBuffer item in Interfaces.All[one.Entry].Storage) {
                        strides[one.Buffers[item.Name]] = item.Stride;
                    }
                }
            }
            return strides;
        }
    }

    /// <summary>
    /// The static buffers of one avatar, uploaded when a pass first binds them, and shared by its instances.
    /// </summary>
    internal sealed class StaticBuffers {
        private static readonly Dictionary<LoadedAvatar, StaticBuffers> All
            = new Dictionary<LoadedAvatar, StaticBuffers>();

        private readonly LoadedAvatar avatar;
        private readonly Dictionary<string, GraphicsBuffer> buffers = new Dictionary<string, GraphicsBuffer>();
        private int users;

        private StaticBuffers(LoadedAvatar avatar) {
            this.avatar = avatar;
        }

        /// <summary>Those of an avatar, until the caller calls Release.</summary>
        public static StaticBuffers Take(LoadedAvatar avatar) {
            StaticBuffers found;
            if (!All.TryGetValue(avatar, out found)) All[avatar] = found = new StaticBuffers(avatar);
            found.users++;
            return found;
        }

        /// <summary>Frees the buffers when nobody uses them any more.</summary>
        public void Release() {
            if (--users > 0) return;
            foreach (GraphicsBuffer buffer in buffers.Values) buffer.Dispose();
            buffers.Clear();
            All.Remove(avatar);
        }

        /// <summary>The buffer of a description. Throws AvatarError where it is too large for this device.</summary>
        public GraphicsBuffer Get(ProgramBuffer described, int stride) {
            GraphicsBuffer buffer;
            if (buffers.TryGetValue(described.Name, out buffer)) return buffer;
            buffers[described.Name] = buffer = GpuBuffers.Make(avatar.Name, described, stride);
            return buffer;
        }
    }
}
