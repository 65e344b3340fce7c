using System;
using System.Collections.Generic;
using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport
{
    /// <summary>
    /// Buffers that a sort needs, as large as the largest scene. All cameras and eyes use the same: their commands
    /// follow each other.
    /// </summary>
    internal sealed class SceneBuffers : IDisposable
    {
        private readonly Dictionary<string, GraphicsBuffer> buffers = new Dictionary<string, GraphicsBuffer>();

        /// <summary>Three float4 a splat, in the order of drawing.</summary>
        public GraphicsBuffer Quads
        {
            get { return buffers["Quads"]; }
        }

        /// <summary>A buffer by its name.</summary>
        public GraphicsBuffer this[string name]
        {
            get { return buffers[name]; }
        }

        /// <summary>
        /// Makes the buffers large enough. Returns whether one was made anew: recorded passes hold the old one then.
        /// </summary>
        public bool Reserve(Core.SceneBuffer[] wanted)
        {
            bool made = false;
            foreach (Core.SceneBuffer one in wanted)
            {
                GraphicsBuffer buffer;
                if (buffers.TryGetValue(one.Name, out buffer) && buffer.count >= one.Count) continue;
                if (buffer != null) buffer.Dispose();
                buffers.Remove(one.Name);
                buffers[one.Name] = GpuBuffers.Make("the scene", "buffer " + one.Name, one.Count, one.Stride);
                made = true;
            }
            return made;
        }

        /// <inheritdoc/>
        public void Dispose()
        {
            foreach (GraphicsBuffer buffer in buffers.Values) buffer.Dispose();
            buffers.Clear();
        }
    }

    /// <summary>The order of all splats of some residents, and the quads that draw them back to front.</summary>
    internal sealed class SortedScene
    {
        /// <summary>In the order of their ids.</summary>
        public readonly Resident[] Residents;

        /// <summary>All splats.</summary>
        public readonly int Count;

        private readonly Core.SceneSort sort;
        private RecordedPasses passes;

        /// <summary>Throws AvatarError for more splats than one sort takes.</summary>
        public SortedScene(List<Resident> residents)
        {
            Residents = residents.ToArray();
            var chunks = new List<Core.ProjectedChunk>();
            for (int i = 0; i < Residents.Length; i++)
            {
                Core.Level level = Residents[i].Level;
                for (int k = 0; k < level.Chunks.Length; k++)
                {
                    string buffer = $"{i}/{level.Prefix}Projected.{k}";
                    chunks.Add(new Core.ProjectedChunk { Buffer = buffer, Count = level.Chunks[k].Count });
                }
            }
            sort = Core.SceneSort.Of(chunks);
            Count = sort.Count;
        }

        /// <summary>What the sort needs.</summary>
        public Core.SceneBuffer[] Buffers
        {
            get { return sort.Buffers; }
        }

        /// <summary>Whether these are the residents, in this order.</summary>
        public bool Holds(List<Resident> residents)
        {
            if (residents.Count != Residents.Length) return false;
            for (int i = 0; i < Residents.Length; i++)
            {
                if (!ReferenceEquals(residents[i], Residents[i])) return false;
            }
            return true;
        }

        /// <summary>Takes the buffers of the scene, when they are large enough.</summary>
        public void Bind(SceneBuffers scene)
        {
            passes = new RecordedPasses(sort.Passes, name => BufferOf(scene, name));
        }

        /// <summary>Records the sort and the gathers of what Projected holds.</summary>
        public void Record(CommandBuffer commands)
        {
            passes.Record(commands);
        }

        private GraphicsBuffer BufferOf(SceneBuffers scene, string name)
        {
            int slash = name.IndexOf('/');
            return slash < 0
                ? scene[name] : Residents[int.Parse(name.Substring(0, slash))].Buffer(name.Substring(slash + 1));
        }
    }
}
