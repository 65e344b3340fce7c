using System;
using System.Linq;
using AvatarExport.Core;

namespace AvatarExport.Play {
    /// <summary>Buffers and dispatches at the other end of a pipe. Buffers of instance i are called "i/NAME" there.</summary>
    internal sealed class PipeGpu : IStageRunner {
        private readonly Pipe pipe;

        public PipeGpu(Pipe pipe) {
            this.pipe = pipe;
        }

        /// <summary>Drops all buffers.</summary>
        public void Begin(string name) => pipe.Tell(Pipe.Json("do", "begin", "name", name));

        public void Load(Program program, SceneBuffer[] scene) {
            LoadProgram(program, "");
            LoadScene(scene);
        }

        public void LoadProgram(Program program, string prefix) {
            foreach (ProgramBuffer one in program.Buffers.Values) {
                Make(prefix + one.Name, one.Bytes, one.Sections.Length > 0 ? one.Content() : new uint[0]);
            }
        }

        public void LoadScene(SceneBuffer[] scene) {
            foreach (SceneBuffer one in scene) Make(one.Name, one.Stride * one.Count, new uint[0]);
        }

        public void Write(string buffer, uint[] words) {
            pipe.Tell(Pipe.Json("do", "write", "name", buffer, "words", words.Length), words);
        }

        public void Read(string buffer, uint[] words) {
            pipe.Ask(Pipe.Json("do", "read", "name", buffer, "words", words.Length), words);
        }

        public void Run(PassList passes, int dispatch) => Run(passes, dispatch, "");

        public void Run(PassList passes, int dispatch, string prefix) {
            Dispatch one = passes.Dispatches[dispatch];
            pipe.Tell(Pipe.Json(
                "do", "run", "entry", one.Entry, "stage", one.Stage, "groups", one.Groups,
                "buffers", one.Buffers.ToDictionary(b => b.Name, b => (object)(prefix + b.Buffer)),
                "constants", one.Constants.ToDictionary(c => c.Name, c => (object)Words(passes, c))));
        }

        public float[] Draw(int quads, int width, int height) {
            var words = new uint[4 * width * height];
            pipe.Ask(Pipe.Json("do", "draw", "quads", quads, "width", width, "height", height), words);
            var image = new float[words.Length];
            Buffer.BlockCopy(words, 0, image, 0, 4 * words.Length);
            return image;
        }

        private void Make(string name, int bytes, uint[] content) {
            pipe.Tell(Pipe.Json("do", "make", "name", name, "bytes", bytes, "words", content.Length), content);
        }

        /// <summary>A constant by the bits of its words.</summary>
        private static uint[] Words(PassList passes, ConstantSlot slot) {
            if (slot.Type == ConstantType.UInt) return new[] { passes.UInts[slot.First] };
            var words = new uint[(int)slot.Type];
            Buffer.BlockCopy(passes.Floats, 4 * slot.First, words, 0, 4 * words.Length);
            return words;
        }
    }
}
