using System;

namespace AvatarExport.Core {
    /// <summary>The words of a packed buffer as kernels read them: small integers, and the numbers that they stand for.</summary>
    internal sealed class PackedWords {
        private readonly uint[] words;
        private readonly float[] floats; // the same bits

        internal PackedWords(ProgramBuffer buffer) {
            words = buffer.Content();
            floats = new float[words.Length];
            Buffer.BlockCopy(words, 0, floats, 0, 4 * words.Length);
        }

        /// <summary>Element `index` of a section that begins at word `section`. Of width 0 every element is 0.</summary>
        internal uint Code(int section, int index, int width) {
            if (width == 32) return words[section + index];
            if (width == 0) return 0;
            int bit = index * width;
            return (words[section + (bit >> 5)] >> (bit & 31)) & ((1u << width) - 1);
        }

        /// <summary>low + step * code, with low and step at word `scale`; of width 32 the float itself.</summary>
        internal float Linear(int section, int index, int width, int scale) {
            if (width == 32) return floats[section + index];
            return floats[scale] + floats[scale + 1] * Code(section, index, width);
        }

        /// <summary>The float of a code, from the table at word `table`; of width 32 the float itself.</summary>
        internal float Table(int section, int index, int width, int table) {
            return width == 32 ? floats[section + index] : floats[table + (int)Code(section, index, width)];
        }
    }

    /// <summary>One array of a packed buffer, found by the constants of a pass: NAME, NAME_width, NAME_scale.</summary>
    internal struct PackedPlanes {
        private readonly PackedWords words;
        private readonly int section, width, scale, rows;

        internal PackedPlanes(PackedWords words, Pass pass, string name, int rows, string suffix = "_scale") {
            this.words = words;
            this.rows = rows;
            section = Number(pass, name);
            width = Number(pass, name + "_width");
            scale = pass.Constants.ContainsKey(name + suffix) ? Number(pass, name + suffix) : 0;
        }

        /// <summary>Element `row` of plane `plane`, decoded.</summary>
        internal double Linear(int plane, int row) {
            return words.Linear(section, plane * rows + row, width, scale + 2 * plane);
        }

        /// <summary>Element `row` of plane `plane` as it is stored.</summary>
        internal int Code(int plane, int row) => (int)words.Code(section, plane * rows + row, width);

        /// <summary>Element `row`, decoded by its table.</summary>
        internal double Table(int row) => words.Table(section, row, width, scale);

        /// <summary>A constant of a pass that is a number.</summary>
        internal static int Number(Pass pass, string name) => (int)pass.Constants[name].Number;
    }
}
