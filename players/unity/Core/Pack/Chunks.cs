using System.Globalization;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>The chunks of a level.</summary>
    internal static class Chunks {
        private const int MostRows = 65535 * 64; // thread groups of one dispatch, threads of one group

        /// <summary>The name of the buffer of one kind ("Splats", "Sh", "Projected") of a chunk of a level.</summary>
        public static string BufferName(Level level, string kind, int chunk) {
            return Invariant($"{level.Prefix}{kind}.{chunk}");
        }

        /// <summary>The chunk whose buffer of that kind has that name; -1 if there is none.</summary>
        public static int IndexOf(Level level, string kind, string name) {
            int begin = level.Prefix.Length + kind.Length + 1;
            int chunk;
            if (name.Length <= begin) return -1;
            string number = name.Substring(begin);
            if (!int.TryParse(number, NumberStyles.None, CultureInfo.InvariantCulture, out chunk)) return -1;
            return chunk < level.Chunks.Length && name == BufferName(level, kind, chunk) ? chunk : -1;
        }

        /// <summary>Throws AvatarError unless the chunks of a level follow each other and each fits one dispatch.</summary>
        public static void Check(string place, Level level) {
            long first = 0;
            for (int index = 0; index < level.Chunks.Length; index++) {
                Run run = level.Chunks[index];
                string field = Invariant($"{place}, chunk {index}");
                if (run.First != first) {
                    throw new AvatarError(Invariant($"begins at row {run.First}, not {first}"), null, field);
                }
                if (run.Count < 1 || run.Count > MostRows) {
                    throw new AvatarError(Invariant($"has {run.Count} rows; 1 to {MostRows} are taken"), null, field);
                }
                first += run.Count;
            }
            if (first < 1 || first > int.MaxValue) throw new AvatarError(Invariant($"has {first} rows"), null, place);
        }
    }
}
