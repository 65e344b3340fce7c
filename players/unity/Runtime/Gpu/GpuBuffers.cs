using System;
using System.Collections.Generic;
using UnityEngine;

namespace AvatarExport
{
    /// <summary>Makes structured buffers, within the limits of this device.</summary>
    internal static class GpuBuffers
    {
        private const int Word = 4; // bytes

        /// <summary>
        /// A buffer of zeros. Throws AvatarError where it is too large for this device; "what" is told then.
        /// </summary>
        public static GraphicsBuffer Make(string owner, string what, long count, int stride)
        {
            long bytes = count * stride, most = SystemInfo.maxGraphicsBufferSize;
            if (bytes > most)
            {
                string reason = $"needs {bytes} bytes, and this device's buffers hold {most}; "
                    + "use a coarser level, or pack it smaller";
                throw new Core.AvatarError(reason, owner, what);
            }
            var buffer = new GraphicsBuffer(GraphicsBuffer.Target.Structured, (int)Math.Max(count, 1), stride);
            buffer.SetData(new uint[Math.Max(count, 1) * stride / Word]);
            return buffer;
        }

        /// <summary>Bytes of an element of each buffer that passes bind: what the shaders declare.</summary>
        public static Dictionary<string, int> Strides(Core.Program program, Core.Level level)
        {
            var strides = new Dictionary<string, int>();
            foreach (Core.Pass[] passes in new[] { program.Mesh, level.Deform, level.View })
            {
                foreach (Core.Pass one in passes)
                {
                    foreach (Core.StorageBuffer item in Core.Interfaces.All[one.Entry].Storage)
                    {
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
    internal sealed class StaticBuffers
    {
        private static readonly Dictionary<Core.Avatar, StaticBuffers> All
            = new Dictionary<Core.Avatar, StaticBuffers>();

        private readonly Core.Avatar avatar;
        private readonly Dictionary<string, GraphicsBuffer> buffers = new Dictionary<string, GraphicsBuffer>();
        private int users;

        private StaticBuffers(Core.Avatar avatar)
        {
            this.avatar = avatar;
        }

        /// <summary>Those of an avatar, until the caller calls Release.</summary>
        public static StaticBuffers Take(Core.Avatar avatar)
        {
            StaticBuffers found;
            if (!All.TryGetValue(avatar, out found)) All[avatar] = found = new StaticBuffers(avatar);
            found.users++;
            return found;
        }

        /// <summary>Frees the buffers when nobody uses them any more.</summary>
        public void Release()
        {
            if (--users > 0) return;
            foreach (GraphicsBuffer buffer in buffers.Values) buffer.Dispose();
            buffers.Clear();
            All.Remove(avatar);
        }

        /// <summary>The buffer of a description. Throws AvatarError where it is too large for this device.</summary>
        public GraphicsBuffer Get(Core.Buffer described, int stride)
        {
            GraphicsBuffer buffer;
            if (buffers.TryGetValue(described.Name, out buffer)) return buffer;
            uint[] content = described.Content();
            int words = stride / 4;
            long count = (content.Length + words - 1) / words;
            buffer = GpuBuffers.Make(avatar.Name, "buffer " + described.Name, count, stride);
            buffers[described.Name] = buffer;
            if (content.Length != count * words) Array.Resize(ref content, (int)count * words);
            if (content.Length > 0) buffer.SetData(content);
            return buffer;
        }
    }
}
