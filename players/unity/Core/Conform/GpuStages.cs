using System;
using System.Collections.Generic;
using System.Linq;

namespace AvatarExport.Core {
    /// <summary>
    /// One stage alone of one avatar at its finest level: inputs are written, its passes run, outputs are read.
    /// </summary>
    internal sealed class GpuStages {
        private const uint NotDrawn = 0xFFFFFFFF; // key of a splat without radius; sorts last
        private const string Pairs = "Pairs";

        private readonly IStageRunner runner;
        private readonly Program program;
        private readonly StageBuffers buffers;
        private readonly FrameValues values;
        private readonly PassList[] lists;
        private readonly SceneSort sort;

        public GpuStages(IStageRunner runner, LoadedAvatar avatar) {
            this.runner = runner;
            program = avatar.Program;
            Level level = program.Levels[0];
            int groups = avatar.Groups.Length;
            buffers = new StageBuffers(runner, program);
            values = new FrameValues(groups);
            lists = Array.ConvertAll(new[] { program.Mesh, level.Deform, level.View, level.Shadow, level.Light }, one => PassList.Of(program, one, groups));
            sort = SceneSort.Of(ProjectedChunk.Of(level).ToArray());
            runner.Load(program, sort.Buffers);
        }

        /// <summary>
        /// Outputs of a stage by the names of the reference. Throws AvatarError for a stage that is not known.
        /// </summary>
        public Dictionary<string, double[]> Run(string stage, Dictionary<string, double[]> x, AvatarCamera camera) {
            buffers.PutPose(x);
            switch (stage) {
                case "morph": return Morph();
                case "skin": return Skin(x);
                case "blend": return Blend();
                case "bind": return Bind(x);
                case "activate": return Activate(x);
                case "shadow": return Shadow(x);
                case "project": return Project(x, camera);
                case "light": return Light(x);
                case "sort": return Sort(x);
                case "raster": return Raster(x, camera);
                default: throw new AvatarError($"there is no stage '{stage}'", "the cases of the reference");
            }
        }

        private void Run(string stage) {
            foreach (PassList list in lists) {
                list.Set(values);
                for (int i = 0; i < list.Dispatches.Length; i++) {
                    if (list.Dispatches[i].Stage == stage) runner.Run(list, i);
                }
            }
        }

        private Dictionary<string, double[]> Morph() {
            Run("morph");
            return new Dictionary<string, double[]> { { "vertices", buffers.TakeMesh() } };
        }

        private Dictionary<string, double[]> Skin(Dictionary<string, double[]> x) {
            buffers.PutMesh(x["vertices"]);
            Run("skin");
            return new Dictionary<string, double[]> { { "posed_vertices", buffers.TakeMesh() } };
        }

        private Dictionary<string, double[]> Blend() {
            Run("blend");
            Dictionary<string, double[]> found = buffers.TakeSplats("mean", "log_scale", "quat_wxyz", "opacity_logit");
            found.Add("sh", buffers.TakeSh());
            return found;
        }

        private Dictionary<string, double[]> Bind(Dictionary<string, double[]> x) {
            buffers.PutSplats(x);
            double[] small = x["group_rotation"];
            var rotation = new float[small.Length / 9 * 12];
            for (int i = 0; i < small.Length; i++) rotation[i / 3 * 4 + i % 3] = (float)small[i];
            values.SetPosed(new Posed {
                GroupMatrix = CpuStages.Floats(x["group_matrix"]),
                GroupRotation = rotation,
                WorldFromAvatar = x["world_from_avatar"],
            });
            if (program.ReadsMesh) buffers.PutMesh(x["posed_vertices"]);
            Run("bind");
            return buffers.TakeSplats("mean", "log_scale", "quat_wxyz", Planes.ShRotation);
        }

        private Dictionary<string, double[]> Activate(Dictionary<string, double[]> x) {
            buffers.PutSplats(x);
            Run("activate");
            return buffers.TakeSplats("scale", "quat_wxyz", "opacity");
        }

        private Dictionary<string, double[]> Project(Dictionary<string, double[]> x, AvatarCamera camera) {
            buffers.PutSplats(x);
            var still = new double[16];
            Affine.SetIdentity(still, 0, 4);
            values.SetCamera(camera, still);
            Run("project");
            return buffers.TakeProjected();
        }

        private void PutLight(Dictionary<string, double[]> x) {
            var light = new LightRows();
            int at = 0;
            foreach (KeyValuePair<string, int> part in LightRows.Parts) {
                double[] given;
                x.TryGetValue(part.Key, out given);
                for (int i = 0; given != null && i < part.Value; i++) light.Floats[at + i] = (float)given[i];
                at += part.Value;
            }
            values.SetLight(light);
            if (x.ContainsKey("world_from_avatar")) values.SetWorld(x["world_from_avatar"]);
        }

        private Dictionary<string, double[]> Shadow(Dictionary<string, double[]> x) {
            PutLight(x);
            buffers.PutSplats(x);
            if (x.ContainsKey("posed_vertices")) buffers.PutMesh(x["posed_vertices"]);
            Run("shadow");
            float[] map = buffers.Read("Shadow", Constants.ShadowSize * Constants.ShadowSize);
            return new Dictionary<string, double[]> { { "shadow", Array.ConvertAll(map, texel => (double)texel) } };
        }

        private Dictionary<string, double[]> Light(Dictionary<string, double[]> x) {
            PutLight(x);
            if (x.ContainsKey("posed_vertices")) {
                buffers.PutMesh(x["posed_vertices"]);
                Run("bind"); // turns triangles
            }
            buffers.PutSplats(x);
            buffers.PutProjected(x);
            if (x.ContainsKey("shadow")) buffers.Write("Shadow", CpuStages.Floats(x["shadow"]));
            Run("light");
            return new Dictionary<string, double[]> { { "rgb", buffers.TakeProjected()["rgb"] } };
        }

        private Dictionary<string, double[]> Sort(Dictionary<string, double[]> x) {
            buffers.PutProjected(x);
            for (int i = 0; i < sort.SortDispatches; i++) runner.Run(sort.Passes, i);
            var pairs = new uint[2 * sort.Count];
            runner.Read(Pairs, pairs);
            var order = new List<double>();
            for (int i = 0; i < pairs.Length; i += 2) {
                if (pairs[i] != NotDrawn) order.Add(pairs[i + 1]);
            }
            return new Dictionary<string, double[]> { { "order", order.ToArray() } };
        }

        private Dictionary<string, double[]> Raster(Dictionary<string, double[]> x, AvatarCamera camera) {
            buffers.PutProjected(x);
            runner.Write(Pairs, PairsOf(x["order"]));
            for (int i = sort.SortDispatches; i < sort.Passes.Dispatches.Length; i++) runner.Run(sort.Passes, i);
            return Over(runner.Draw(sort.Count, camera.Width, camera.Height), x["background"]);
        }

        /// <summary>The drawn splats in their order, then all others.</summary>
        private uint[] PairsOf(double[] order) {
            var pairs = new uint[2 * sort.Count];
            var drawn = new HashSet<uint>();
            int at = 0;
            foreach (double id in order) {
                drawn.Add((uint)id);
                pairs[at + 1] = (uint)id;
                at += 2;
            }
            for (uint id = 0; id < sort.Count; id++) {
                if (drawn.Contains(id)) continue;
                pairs[at] = NotDrawn;
                pairs[at + 1] = id;
                at += 2;
            }
            return pairs;
        }

        private static Dictionary<string, double[]> Over(float[] image, double[] background) {
            int pixels = image.Length / 4;
            var colour = new double[3 * pixels];
            var transmittance = new double[pixels];
            for (int i = 0; i < pixels; i++) {
                transmittance[i] = 1 - (double)image[4 * i + 3];
                for (int c = 0; c < 3; c++) colour[3 * i + c] = image[4 * i + c] + transmittance[i] * background[c];
            }
            return new Dictionary<string, double[]> { { "colour", colour }, { "transmittance", transmittance } };
        }
    }
}
