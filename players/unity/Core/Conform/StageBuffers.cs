using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>Arrays of stages to and from the buffers of one avatar at its finest level.</summary>
    internal sealed class StageBuffers {
        private readonly IStageRunner runner;
        private readonly Program program;
        private readonly Level level;
        private readonly int shTerms;

        public StageBuffers(IStageRunner runner, Program program) {
            this.runner = runner;
            this.program = program;
            level = program.Levels[0];
            shTerms = (int)level.Deform[0].Constants["sh_terms"].Number;
            foreach (Run chunk in level.Chunks) Rows += chunk.Count;
        }

        /// <summary>Gaussians of the level.</summary>
        public int Rows { get; }

        public void Write(string buffer, float[] floats) {
            var words = new uint[floats.Length];
            Buffer.BlockCopy(floats, 0, words, 0, 4 * floats.Length);
            runner.Write(buffer, words);
        }

        public float[] Read(string buffer, int count) {
            var words = new uint[count];
            runner.Read(buffer, words);
            var floats = new float[count];
            Buffer.BlockCopy(words, 0, floats, 0, 4 * count);
            return floats;
        }

        /// <summary>Buffer Pose; arrays that are not given are 0.</summary>
        public void PutPose(Dictionary<string, double[]> x) {
            if (program.PoseFloats == 0) return;
            var floats = new float[program.PoseFloats];
            PutFloats(floats, program.Pose.Weights, x, "expression_weights");
            PutFloats(floats, program.Pose.Features, x, "pose_feature");
            PutFloats(floats, program.Pose.Late, x, "late_weights");
            double[] skin;
            if (x.TryGetValue("skin_matrix", out skin)) {
                for (int i = 0; i < skin.Length; i++) {
                    if (i % 16 < 12) floats[program.Pose.Joints + i / 16 * 12 + i % 16] = (float)skin[i];
                }
            }
            Write("Pose", floats);
        }

        public void PutMesh(double[] vertices) {
            var floats = new float[vertices.Length / 3 * 4];
            for (int i = 0; i < floats.Length; i++) floats[i] = i % 4 == 3 ? 1 : (float)vertices[i / 4 * 3 + i % 4];
            Write("Mesh", floats);
        }

        public double[] TakeMesh() {
            int vertices = (int)program.Mesh[0].Constants["vertices"].Number;
            float[] plane = Read("Mesh", 4 * vertices);
            var found = new double[3 * vertices];
            for (int i = 0; i < found.Length; i++) found[i] = plane[i / 3 * 4 + i % 3];
            return found;
        }

        public void PutSplats(Dictionary<string, double[]> x) {
            Put("Splats", Planes.Splats, Planes.SplatPlaces, x);
            double[] sh;
            if (!x.TryGetValue("sh", out sh)) return;
            for (int i = 0; i < level.Chunks.Length; i++) {
                Run chunk = level.Chunks[i];
                var planes = new float[3 * shTerms * chunk.Count]; // plane 3 k + channel; arrays have [N, terms, 3]
                for (int at = 0; at < planes.Length; at++) {
                    planes[at] = (float)sh[(chunk.First + at % chunk.Count) * 3 * shTerms + at / chunk.Count];
                }
                Write(Chunks.BufferName(level, "Sh", i), planes);
            }
        }

        public double[] TakeSh() {
            var found = new double[3 * shTerms * Rows];
            for (int i = 0; i < level.Chunks.Length; i++) {
                Run chunk = level.Chunks[i];
                float[] planes = Read(Chunks.BufferName(level, "Sh", i), 3 * shTerms * chunk.Count);
                for (int at = 0; at < planes.Length; at++) {
                    found[(chunk.First + at % chunk.Count) * 3 * shTerms + at / chunk.Count] = planes[at];
                }
            }
            return found;
        }

        public void PutProjected(Dictionary<string, double[]> x) {
            Put("Projected", Planes.Projected, Planes.ProjectedPlaces, x);
        }

        public Dictionary<string, double[]> TakeSplats(params string[] names) {
            return Take("Splats", Planes.Splats, Planes.SplatPlaces, names);
        }

        public Dictionary<string, double[]> TakeProjected() {
            return Take("Projected", Planes.Projected, Planes.ProjectedPlaces, new List<string>(Planes.ProjectedPlaces.Keys));
        }

        private void Put(string kind, int planes, Dictionary<string, Place> places, Dictionary<string, double[]> x) {
            for (int i = 0; i < level.Chunks.Length; i++) {
                Run chunk = level.Chunks[i];
                var floats = new float[4 * planes * chunk.Count];
                foreach (KeyValuePair<string, double[]> one in x) {
                    bool rotation = one.Key == Planes.ShRotation && kind == "Splats";
                    if (rotation || places.ContainsKey(one.Key)) Planes.Put(floats, places, one.Key, one.Value, chunk);
                }
                Write(Chunks.BufferName(level, kind, i), floats);
            }
        }

        private Dictionary<string, double[]> Take(string kind, int planes, Dictionary<string, Place> places, IList<string> names) {
            var found = new Dictionary<string, double[]>();
            foreach (string name in names) found.Add(name, new double[Rows * Planes.Components(places, name)]);
            for (int i = 0; i < level.Chunks.Length; i++) {
                Run chunk = level.Chunks[i];
                float[] floats = Read(Chunks.BufferName(level, kind, i), 4 * planes * chunk.Count);
                foreach (string name in names) Planes.Take(floats, places, name, found[name], chunk);
            }
            return found;
        }

        private static void PutFloats(float[] floats, int at, Dictionary<string, double[]> x, string name) {
            double[] values;
            if (!x.TryGetValue(name, out values)) return;
            for (int i = 0; i < values.Length; i++) floats[at + i] = (float)values[i];
        }
    }
}
