namespace AvatarExport.Core {
    /// <summary>
    /// What an engine does for Conform: it holds the buffers of an avatar's program and of its scene, by their names,
    /// runs dispatches, and draws quads. Writable buffers begin with zeros.
    /// </summary>
    public interface IStageRunner {
        /// <summary>
        /// Makes the buffers of a program, with the contents of those that have sections, and those of a scene.
        /// </summary>
        void Load(Program program, SceneBuffer[] scene);

        /// <summary>Writes words from a buffer's beginning on.</summary>
        void Write(string buffer, uint[] words);

        /// <summary>Reads words from a buffer's beginning on.</summary>
        void Read(string buffer, uint[] words);

        /// <summary>Runs one dispatch of a list, with the list's constants; the next call sees what it wrote.</summary>
        void Run(PassList passes, int dispatch);

        /// <summary>
        /// Draws the quads of buffer "Quads", in their order, into a float image of zeros: premultiplied colour and
        /// alpha, each over what is there. Returns [height, width, 4], first row on top.
        /// </summary>
        float[] Draw(int quads, int width, int height);
    }
}
