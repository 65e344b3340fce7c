using System;
using System.Linq;

namespace AvatarExport.Core {
    /// <summary>The vertices of one pass of stage morph or skin, decoded.</summary>
    internal sealed class MeshPass {
        public readonly int First;
        public readonly int Count;
        private readonly Pass pass;
        private readonly ProgramBuffer buffer;

        private MeshPass(Pass pass, ProgramBuffer buffer) {
            this.pass = pass;
            this.buffer = buffer;
            First = Number("first");
            Count = Number("count");
        }

        /// <summary>Of the whole mesh; a constant of stage morph.</summary>
        public int Vertices => Number("vertices");

        /// <summary>All passes of an entry, whose packed buffer the shader calls `buffer`.</summary>
        public static MeshPass[] All(Program program, string entry, string buffer) {
            return program.Mesh.Where(one => one.Entry == entry)
                .Select(one => new MeshPass(one, program.Buffers[one.Buffers[buffer]])).ToArray();
        }

        /// <summary>Component c of a vertex at rest, by its row in the pass.</summary>
        public float Template(int row, int c) {
            Elements codes = buffer.Find("template_position").Elements;
            int width = Number("template_position_width"), at = c * Count + row;
            if (width == 32) return codes.FloatAt(at);
            Elements scale = buffer.Find("template_position_scale").Elements;
            float step = (float)((double)scale.FloatAt(2 * c + 1) * (width == 0 ? 0 : codes[at])); // rounds as the kernel does
            return (float)((double)scale.FloatAt(2 * c) + step);
        }

        /// <summary>The sparse rows PART_ptr, PART_column and PART + values.</summary>
        public SparseRows Rows(string part, string values, int channels) {
            return new SparseRows(buffer, part, part + values, Number(part + values + "_width"), channels);
        }

        private int Number(string name) => (int)pass.Constants[name].Number;
    }

    /// <summary>Entries of vertices in a packed buffer: a column and one value a channel each.</summary>
    internal sealed class SparseRows {
        private readonly Elements pointer;
        private readonly Elements columns;
        private readonly Elements codes;
        private readonly Elements steps;
        private readonly int width;
        private readonly int channels; // 3 of deltas, which are signed; 1 of weights

        public SparseRows(ProgramBuffer buffer, string part, string values, int width, int channels) {
            pointer = buffer.Find(part + "_ptr").Elements;
            columns = buffer.Find(part + "_column").Elements;
            codes = buffer.Find(values).Elements;
            steps = width == 0 || width == 32 ? null : buffer.Find(values + "_step").Elements;
            this.width = width;
            this.channels = channels;
        }

        /// <summary>The first entry of a row.</summary>
        public int First(int row) => (int)pointer[row];

        /// <summary>The column of an entry.</summary>
        public int Column(int entry) => (int)columns[entry];

        /// <summary>A channel of an entry.</summary>
        public float Value(int entry, int channel) {
            int at = channels * entry + channel;
            if (width == 0) return 0; // of signed codes the middle, of weights the code 0
            if (width == 32) return codes.FloatAt(at);
            if (channels == 1) return (float)((double)steps.FloatAt(0) * codes[at]);
            return (float)(steps.FloatAt(channels * Column(entry) + channel) * (codes[at] - Math.Pow(2, width - 1)));
        }
    }
}
