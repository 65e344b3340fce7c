using System.Collections.Generic;
using System.Linq;
using AvatarExport.Core;

namespace AvatarExport.Play
{
    /// <summary>
    /// Buffers and dispatches at the other end of a pipe. Buffers of instance i are called "i/NAME" there.
    /// </summary>
    internal sealed class PipeGpu : IStageRunner
    {
        private readonly Pipe pipe;

        public PipeGpu(Pipe pipe)
        {
            this.pipe = pipe;
        }

        /// <summary>Drops all buffers.</summary>
        public void Begin(string name)
        {
            pipe.Tell(Pipe.Object("do", "\"begin\"", "name", Pipe.Text(name)), new uint[0]);
        }

        public void Load(Program program, SceneBuffer[] scene)
        {
            LoadProgram(program, "");
            LoadScene(scene);
        }

        public void LoadProgram(Program program, string prefix)
        {
            foreach (Buffer one in program.Buffers.Values)
            {
                uint[] content = one.Sections.Length > 0 ? one.Content() : new uint[0];
                Make(prefix + one.Name, one.Bytes, content);
            }
        }

        public void LoadScene(SceneBuffer[] scene)
        {
            foreach (SceneBuffer one in scene) Make(one.Name, one.Stride * one.Count, new uint[0]);
        }

        public void Write(string buffer, uint[] words)
        {
            pipe.Tell(Pipe.Object("do", "\"write\"", "name", Pipe.Text(buffer), "words", words.Length.ToString()), words);
        }

        public void Read(string buffer, uint[] words)
        {
            pipe.Ask(Pipe.Object("do", "\"read\"", "name", Pipe.Text(buffer), "words", words.Length.ToString()), new uint[0], words);
        }

        public void Run(PassList passes, int dispatch)
        {
            Run(passes, dispatch, "");
        }

        public void Run(PassList passes, int dispatch, string prefix)
        {
            Dispatch one = passes.Dispatches[dispatch];
            var buffers = one.Buffers.SelectMany(b => new[] { b.Name, Pipe.Text(prefix + b.Buffer) }).ToArray();
            var constants = one.Constants.SelectMany(c => new[] { c.Name, Words(passes, c) }).ToArray();
            pipe.Tell(
                Pipe.Object(
                    "do", "\"run\"", "entry", Pipe.Text(one.Entry), "stage", Pipe.Text(one.Stage), "groups", one.Groups.ToString(),
                    "buffers", Pipe.Object(buffers), "constants", Pipe.Object(constants)),
                new uint[0]);
        }

        public float[] Draw(int quads, int width, int height)
        {
            var words = new uint[4 * width * height];
            string[] sizes = { "quads", quads.ToString(), "width", width.ToString(), "height", height.ToString() };
            pipe.Ask(Pipe.Object(new[] { "do", "\"draw\"" }.Concat(sizes).ToArray()), new uint[0], words);
            var image = new float[words.Length];
            System.Buffer.BlockCopy(words, 0, image, 0, 4 * words.Length);
            return image;
        }

        private void Make(string name, int bytes, uint[] content)
        {
            string[] said = { "do", "\"make\"", "name", Pipe.Text(name), "bytes", bytes.ToString(), "words", content.Length.ToString() };
            pipe.Tell(Pipe.Object(said), content);
        }

        /// <summary>A constant by the bits of its words.</summary>
        private static string Words(PassList passes, ConstantSlot slot)
        {
            if (slot.Type == ConstantType.UInt) return Pipe.List(new[] { passes.UInts[slot.First].ToString() });
            var words = new uint[(int)slot.Type];
            System.Buffer.BlockCopy(passes.Floats, 4 * slot.First, words, 0, 4 * words.Length);
            return Pipe.List(words.Select(word => word.ToString()));
        }
    }
}
