using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using AvatarExport.Core;

namespace AvatarExport.Play {
    /// <summary>
    /// Plays a job, a JSON file: its scenes, and its references. All that a GPU does, Python does; all that it is told
    /// comes from here.
    /// </summary>
    internal static class Player {
        private static int Main(string[] arguments) {
            var pipe = new Pipe();
            var gpu = new PipeGpu(pipe);
            var job = new Json(JsonText.Parse(File.ReadAllText(arguments[0])), "$");
            foreach (Json scene in job.At("scenes").List()) Play(gpu, scene);
            foreach (Json folder in job.At("references").List()) Repeat(pipe, gpu, folder.Text());
            pipe.Close();
            return 0;
        }

        private static void Play(PipeGpu gpu, Json scene) {
            gpu.Begin(scene.At("name").Text());
            AvatarCamera camera = Seen(scene.At("camera"));
            var chunks = new List<ProjectedChunk>();
            Json[] avatars = scene.At("avatars").List();
            for (int i = 0; i < avatars.Length; i++) chunks.AddRange(Project(gpu, avatars[i], i + "/", camera));
            SceneSort sort = SceneSort.Of(chunks);
            gpu.LoadScene(sort.Buffers);
            for (int i = 0; i < sort.Passes.Dispatches.Length; i++) gpu.Run(sort.Passes, i);
            gpu.Draw(sort.Count, camera.Width, camera.Height);
        }

        /// <summary>
        /// Stages up to project of an avatar; its projected chunks. "twice": at rest first, so that the pose finds what
        /// lasts.
        /// </summary>
        private static IEnumerable<ProjectedChunk> Project(PipeGpu gpu, Json said, string prefix, AvatarCamera camera) {
            string file = said.At("file").Text();
            LoadedAvatar avatar = LoadedAvatar.Load(File.ReadAllBytes(file), file);
            var instance = new Instance(avatar, said.At("level").Int());
            Doubles(said.At("place")).CopyTo(instance.Place, 0);
            instance.Light = said.Optional("light", SceneLight, null);
            instance.UpdatePose();
            gpu.LoadProgram(avatar.Program, prefix);
            PassList[] lists = Lists(instance).Select(one => PassList.Of(avatar.Program, one, avatar.Groups.Length)).ToArray();
            if (said.At("twice").Flag()) {
                instance.Update(camera); // at rest
                Run(gpu, instance, lists, prefix);
                foreach (PassList list in lists) list.KeepLasting();
            }
            Take(said.At("pose"), instance.Pose);
            instance.Update(camera);
            Run(gpu, instance, lists, prefix);
            return ProjectedChunk.Of(instance.Program, prefix);
        }

        /// <summary>What a frame runs: of a light what it needs.</summary>
        private static IEnumerable<Pass[]> Lists(Instance instance) {
            Pass[] shadow = instance.CastsShadow ? instance.Program.Shadow : new Pass[0];
            bool needsMesh = instance.Avatar.Program.ReadsMesh || shadow.Any(one => one.Buffers.ContainsKey("Mesh"));
            if (needsMesh) yield return instance.Avatar.Program.Mesh;
            yield return instance.Program.Deform;
            yield return shadow;
            yield return instance.Program.View;
            if (instance.Light != null) yield return instance.Program.Light;
        }

        private static SceneLight SceneLight(Json said) {
            Json[] lights = said.At("lights").List();
            var light = new SceneLight { Count = lights.Length, Shadow = said.At("shadow").Flag() };
            said.At("ambient").List().SelectMany(Doubles).ToArray().CopyTo(light.Ambient, 0);
            for (int i = 0; i < lights.Length; i++) {
                Json[] parts = lights[i].List();
                Doubles(parts[0]).CopyTo(light.Lights[i].Place, 0);
                Doubles(parts[1]).CopyTo(light.Lights[i].Colour, 0);
                light.Lights[i].IsPoint = parts[2].Flag();
            }
            return light;
        }

        private static void Take(Json said, AvatarPose into) {
            Floats(said.At("expressionWeights")).CopyTo(into.ExpressionWeights, 0);
            Floats(said.At("lateWeights")).CopyTo(into.LateWeights, 0);
            Doubles(said.At("jointDelta")).CopyTo(into.JointDelta, 0);
            Doubles(said.At("worldFromAvatar")).CopyTo(into.WorldFromAvatar, 0);
        }

        private static void Run(PipeGpu gpu, Instance instance, PassList[] lists, string prefix) {
            if (instance.PoseFloats.Length > 0) gpu.Write(prefix + "Pose", Words(instance.PoseFloats));
            foreach (PassList list in lists) {
                list.Set(instance.Values);
                for (int i = 0; i < list.Dispatches.Length; i++) gpu.Run(list, i, prefix);
            }
        }

        /// <summary>A reference in a folder, with its pack.</summary>
        private static void Repeat(Pipe pipe, PipeGpu gpu, string folder) {
            gpu.Begin(folder);
            Func<string, string> at = name => Path.Combine(folder, name);
            LoadedAvatar avatar = LoadedAvatar.Load(File.ReadAllBytes(at("mini.avatar")), folder);
            Func<string, string, Reference> parsed =
                (cases, vectors) => Reference.Parse(File.ReadAllText(at(cases)), File.ReadAllBytes(at(vectors)));
            Report(pipe, folder, Conform.Run(avatar, parsed("cases.json", "vectors.safetensors"), gpu));
            if (!File.Exists(at("driving.json"))) return;
            Report(pipe, folder, Conform.Run(avatar, parsed("driving.json", "driving.safetensors"), null));
        }

        private static void Report(Pipe pipe, string folder, ConformReport report) {
            var rows = report.Rows.Select(row => new Dictionary<string, object> {
                ["case"] = row.Case, ["stage"] = row.Stage, ["output"] = row.Output, ["used"] = row.Verdict.Used,
                ["passed"] = row.Verdict.Passed,
            });
            pipe.Tell(Pipe.Json("do", "report", "name", folder, "rows", rows));
        }

        private static AvatarCamera Seen(Json said) {
            var camera = new AvatarCamera();
            float[] tan = { (float)said.At("tanHalfFovX").Number(), (float)said.At("tanHalfFovY").Number() };
            camera.SetMatrices(
                Floats(said.At("cameraFromWorld")), Floats(said.At("clipFromWorld")), Floats(said.At("centre")), tan,
                said.At("width").Int(), said.At("height").Int());
            return camera;
        }

        private static double[] Doubles(Json said) => said.List().Select(one => one.Number()).ToArray();

        private static float[] Floats(Json said) => said.List().Select(one => (float)one.Number()).ToArray();

        private static uint[] Words(float[] floats) {
            var words = new uint[floats.Length];
            Buffer.BlockCopy(floats, 0, words, 0, 4 * words.Length);
            return words;
        }
    }
}
