using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using AvatarExport.Core;

namespace AvatarExport.Play
{
    /// <summary>
    /// Plays a job, a JSON file: its scenes, and its references. All that a GPU does, Python does; all that it is told
    /// comes from here.
    /// </summary>
    internal static class Player
    {
        private static int Main(string[] arguments)
        {
            var pipe = new Pipe();
            var gpu = new PipeGpu(pipe);
            var job = new Json(JsonText.Parse(File.ReadAllText(arguments[0])), "$");
            foreach (Json scene in job.At("scenes").List()) Play(gpu, scene);
            foreach (Json folder in job.At("references").List()) Repeat(pipe, gpu, folder.Text());
            pipe.Close();
            return 0;
        }

        private static void Play(PipeGpu gpu, Json scene)
        {
            gpu.Begin(scene.At("name").Text());
            Camera camera = Seen(scene.At("camera"));
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
        private static IEnumerable<ProjectedChunk> Project(PipeGpu gpu, Json said, string prefix, Camera camera)
        {
            string file = said.At("file").Text();
            Avatar avatar = Pack.Read(File.ReadAllBytes(file), file);
            var instance = new Instance(avatar, said.At("level").Int());
            Doubles(said.At("world")).CopyTo(instance.World, 0);
            gpu.LoadProgram(avatar.Program, prefix);
            Pass[] mesh = avatar.Program.ReadsMesh ? avatar.Program.Mesh : new Pass[0];
            PassList[] lists = new[] { mesh, instance.Program.Deform, instance.Program.View }
                .Select(passes => PassList.Of(avatar.Program, passes, avatar.Groups.Length)).ToArray();
            if (said.At("twice").Flag())
            {
                instance.Update(camera); // at rest
                Run(gpu, instance, lists, prefix);
                lists[1].KeepLasting();
            }
            Take(said.At("pose"), instance.Pose);
            instance.Update(camera);
            Run(gpu, instance, lists, prefix);
            return instance.Program.Chunks.Select((run, i) => new ProjectedChunk
            {
                Buffer = prefix + instance.Program.Prefix + "Projected." + i,
                Count = run.Count,
            });
        }

        private static void Take(Json said, Pose into)
        {
            Floats(said.At("expressionWeights")).CopyTo(into.ExpressionWeights, 0);
            Floats(said.At("lateWeights")).CopyTo(into.LateWeights, 0);
            Doubles(said.At("jointDelta")).CopyTo(into.JointDelta, 0);
            Doubles(said.At("worldFromAvatar")).CopyTo(into.WorldFromAvatar, 0);
        }

        private static void Run(PipeGpu gpu, Instance instance, PassList[] lists, string prefix)
        {
            if (instance.PoseFloats.Length > 0) gpu.Write(prefix + "Pose", Words(instance.PoseFloats));
            foreach (PassList list in lists)
            {
                list.Set(instance.Values);
                for (int i = 0; i < list.Dispatches.Length; i++) gpu.Run(list, i, prefix);
            }
        }

        /// <summary>A reference in a folder, with its pack.</summary>
        private static void Repeat(Pipe pipe, PipeGpu gpu, string folder)
        {
            gpu.Begin(folder);
            string mini = Path.Combine(folder, "mini.avatar");
            Avatar avatar = Pack.Read(File.ReadAllBytes(mini), mini);
            Report(pipe, folder, Conformed(avatar, folder, "cases.json", "vectors.safetensors", gpu));
            if (!File.Exists(Path.Combine(folder, "driving.json"))) return;
            Report(pipe, folder, Conformed(avatar, folder, "driving.json", "driving.safetensors", null));
        }

        private static ConformReport Conformed(Avatar avatar, string folder, string cases, string vectors, IStageRunner runner)
        {
            string text = File.ReadAllText(Path.Combine(folder, cases));
            return Conform.Run(avatar, Reference.Parse(text, File.ReadAllBytes(Path.Combine(folder, vectors))), runner);
        }

        private static void Report(Pipe pipe, string folder, ConformReport report)
        {
            var rows = report.Rows.Select(row => Pipe.Object(
                "case", Pipe.Text(row.Case), "stage", Pipe.Text(row.Stage), "output", Pipe.Text(row.Output),
                "used", Pipe.Number(row.Verdict.Used), "flips", row.Verdict.Flips.ToString(),
                "passed", row.Verdict.Passed ? "true" : "false"));
            pipe.Tell(Pipe.Object("do", "\"report\"", "name", Pipe.Text(folder), "rows", Pipe.List(rows)), new uint[0]);
        }

        private static Camera Seen(Json said)
        {
            var camera = new Camera();
            float[] tan = { (float)said.At("tanHalfFovX").Number(), (float)said.At("tanHalfFovY").Number() };
            camera.SetMatrices(
                Floats(said.At("cameraFromWorld")), Floats(said.At("clipFromWorld")), Floats(said.At("centre")), tan,
                said.At("width").Int(), said.At("height").Int());
            return camera;
        }

        private static double[] Doubles(Json said)
        {
            return said.List().Select(one => one.Number()).ToArray();
        }

        private static float[] Floats(Json said)
        {
            return said.List().Select(one => (float)one.Number()).ToArray();
        }

        private static uint[] Words(float[] floats)
        {
            var words = new uint[floats.Length];
            System.Buffer.BlockCopy(floats, 0, words, 0, 4 * words.Length);
            return words;
        }
    }
}
