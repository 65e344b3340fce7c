using System;
using System.Collections.Generic;
using System.Linq;

namespace AvatarExport.Core {
    /// <summary>
    /// A run of projected splats in one buffer of the scene, by the buffer's name: "0/l0.Projected.0".
    /// </summary>
    public struct ProjectedChunk {
        /// <summary>The buffer.</summary>
        public string Buffer;

        /// <summary>Its splats.</summary>
        public int Count;

        /// <summary>The chunks of a level. `prefix` is that of its avatar's buffers in the scene: "0/".</summary>
        public static IEnumerable<ProjectedChunk> Of(Level level, string prefix = "") {
            return level.Chunks.Select((run, i) => new ProjectedChunk {
                Buffer = prefix + Chunks.BufferName(level, "Projected", i),
                Count = run.Count,
            });
        }
    }

    /// <summary>A buffer that belongs to a scene, not to an avatar.</summary>
    public struct SceneBuffer {
        /// <summary>Its name in BufferBinding.Buffer.</summary>
        public string Name;

        /// <summary>Bytes of an element.</summary>
        public int Stride;

        /// <summary>Elements; at least 1, because graphics interfaces have no empty buffers.</summary>
        public int Count;
    }

    /// <summary>
    /// Stage sort of all splats of a scene, and the gather that writes the quads which draw them back to front: one
    /// stable radix sort without wave operations.
    /// </summary>
    public sealed class SceneSort {
        private const string Pairs = "Pairs", PairsOut = "PairsOut", Counts = "Counts", Quads = "Quads";
        private const int Digits = Constants.SortDigits, Bits = 4, Turns = 8; // 8 digits of 4 bits: a key of 32 bits

        private SceneSort(int count, SceneBuffer[] buffers, PassList passes, int sortDispatches) {
            Count = count;
            Buffers = buffers;
            Passes = passes;
            SortDispatches = sortDispatches;
        }

        /// <summary>All splats.</summary>
        public int Count { get; }

        /// <summary>
        /// "Pairs" (key, id) in the order of drawing from front to back, "PairsOut" and "Counts" for the sort alone,
        /// and "Quads", three float4 a splat, in the order of drawing from back to front.
        /// </summary>
        public SceneBuffer[] Buffers { get; }

        /// <summary>The sort, then the gathers. No value depends on the frame.</summary>
        public PassList Passes { get; }

        /// <summary>How many dispatches of Passes sort; those that follow gather.</summary>
        public int SortDispatches { get; }

        /// <summary>
        /// The sort of chunks that follow each other; an id counts through all of them. Throws AvatarError for more
        /// splats than one dispatch or one buffer has.
        /// </summary>
        public static SceneSort Of(IReadOnlyList<ProjectedChunk> chunks) {
            int count = CheckedCount(chunks);
            int blocks = Math.Max(PassListBuilder.GroupsOf(count, Constants.SortBlock), 1);
            var made = new PassListBuilder(null);
            int sorting = count == 0 ? 0 : chunks.Count + 3 * Turns;
            if (count > 0) {
                AddKeys(made, chunks);
                AddTurns(made, count, blocks);
                AddGathers(made, chunks, count);
            }
            var buffers = new[] {
                new SceneBuffer { Name = Pairs, Stride = 8, Count = Math.Max(count, 1) },
                new SceneBuffer { Name = PairsOut, Stride = 8, Count = Math.Max(count, 1) },
                new SceneBuffer { Name = Counts, Stride = 4, Count = Digits * blocks },
                new SceneBuffer { Name = Quads, Stride = 16, Count = Math.Max(3 * count, 3) },
            };
            return new SceneSort(count, buffers, made.Build(), sorting);
        }

        private static int CheckedCount(IReadOnlyList<ProjectedChunk> chunks) {
            long count = 0;
            foreach (ProjectedChunk chunk in chunks) count += chunk.Count;
            const long Most = 65535L * 64; // groups of one dispatch, threads of a gather
            if (count > Most) throw new AvatarError($"has {count} splats; one sort takes {Most}", "the scene");
            return (int)count;
        }

        private static void AddKeys(PassListBuilder made, IReadOnlyList<ProjectedChunk> chunks) {
            int first = 0;
            foreach (ProjectedChunk chunk in chunks) {
                Pass one = Make("sort_keys", "Projected", chunk.Buffer, "Pairs", Pairs);
                Give(one, "count", chunk.Count, "first", first);
                made.Add(one, PassListBuilder.GroupsOf(chunk.Count, Constants.Threads));
                first += chunk.Count;
            }
        }

        /// <summary>An even number of turns ends where it began.</summary>
        private static void AddTurns(PassListBuilder made, int count, int groups) {
            for (int turn = 0; turn < Turns; turn++) {
                string here = turn % 2 == 0 ? Pairs : PairsOut, there = turn % 2 == 0 ? PairsOut : Pairs;
                foreach (string entry in new[] { "sort_count", "sort_scan", "sort_scatter" }) {
                    Pass one = Make(entry, "Pairs", here, "PairsOut", there, "Counts", Counts);
                    Give(one, "count", count, "groups", groups, "shift", Bits * turn, "total", Digits * groups);
                    made.Add(one, entry == "sort_scan" ? 1 : groups);
                }
            }
        }

        private static void AddGathers(PassListBuilder made, IReadOnlyList<ProjectedChunk> chunks, int count) {
            int first = 0;
            foreach (ProjectedChunk chunk in chunks) {
                Pass one = Make("raster_gather", "Projected", chunk.Buffer, "Pairs", Pairs, "Quads", Quads);
                Give(one, "count", count, "begin", 0, "piece_count", count);
                Give(one, "first", first, "chunk_count", chunk.Count, "reverse", 1);
                made.Add(one, PassListBuilder.GroupsOf(count, Constants.Threads));
                first += chunk.Count;
            }
        }

        private static Pass Make(string entry, params string[] buffers) {
            var bound = new Dictionary<string, string>();
            for (int i = 0; i < buffers.Length; i += 2) bound[buffers[i]] = buffers[i + 1];
            return new Pass { Entry = entry, Buffers = bound, Constants = new Dictionary<string, Constant>() };
        }

        private static void Give(Pass one, params object[] values) {
            for (int i = 0; i < values.Length; i += 2) {
                one.Constants[(string)values[i]] = new Constant { Number = (int)values[i + 1] };
            }
        }
    }
}
