using System;
using System.Collections.Generic;
using AvatarExport.Core;
using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport {
    /// <summary>
    /// Buffers that a sort needs, as large as the largest scene. All cameras and eyes use the same: their commands
    /// follow each other.
    /// </summary>
    internal sealed class SceneBuffers : IDisposable {
        private readonly Dictionary<string, GraphicsBuffer> buffers = new Dictionary<string, GraphicsBuffer>();

        /// <summary>Three float4 a splat, in the order of drawing.</summary>
        public GraphicsBuffer Quads => buffers["Quads"];

        /// <summary>A buffer by its name.</summary>
        public GraphicsBuffer this[string name] => buffers[name];

        /// <summary>
        /// Makes the buffers large enough. Returns whether one was made anew: recorded passes hold the old one then.
        /// </summary>
        public bool Reserve(SceneBuffer[] wanted) {
            bool made = false;
            foreach (SceneBuffer one in wanted) {
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
        public void Dispose() {
            foreach (GraphicsBuffer buffer in buffers.Values) buffer.Dispose();
            buffers.Clear();
        }
    }

    /// <summary>The order of all splats of some residents, and the quads that draw them back to front.</summary>
    internal sealed class SortedScene {
        /// <summary>In the order of their ids.</summary>
        public readonly Resident[] Residents;

        public readonly int Count;

        private readonly SceneSort sort;
        private RecordedPasses passes;

        /// <summary>Throws AvatarError for more splats than one sort takes.</summary>
        public SortedScene(List<Resident> residents) {
            Residents = residents.ToArray();
            var chunks = new List<ProjectedChunk>();
            for (int i = 0; i < Residents.Length; i++) chunks.AddRange(ProjectedChunk.Of(Residents[i].Level, i + "/"));
            sort = SceneSort.Of(chunks);
            Count = sort.Count;
        }

        public SceneBuffer[] Buffers => sort.Buffers;

        /// <summary>Whether these are the residents, in this order.</summary>
        public bool Holds(List<Resident> residents) {
            if (residents.Count != Residents.Length) return false;
            for (int i = 0; i < Residents.Length; i++) {
                if (!ReferenceEquals(residents[i], Residents[i])) return false;
            }
            return true;
        }

        /// <summary>Takes the buffers of the scene, when they are large enough.</summary>
        public void Bind(SceneBuffers scene) {
            passes = new RecordedPasses(sort.Passes, name => BufferOf(scene, name));
        }

        /// <summary>Records the sort and the gathers of what Projected holds.</summary>
        public void Record(CommandBuffer commands) => passes.Record(commands);

        private GraphicsBuffer BufferOf(SceneBuffers scene, string name) {
            int slash = name.IndexOf('/');
            return slash < 0
                ? scene[name] : Residents[int.Parse(name.Substring(0, slash))].Buffer(name.Substring(slash + 1));
        }
    }
}
