using System;
using System.Collections.Generic;
using System.Globalization;

namespace AvatarExport.Core {
    /// <summary>Where the values of a frame lie in FrameValues.Floats, for an avatar of some groups.</summary>
    public sealed class FrameLayout {
        private const string PerGroup = "group_";

        private readonly Dictionary<string, int> first = new Dictionary<string, int>(StringComparer.Ordinal);

        /// <summary>The layout for an avatar of that many groups.</summary>
        public FrameLayout(int groups) {
            foreach (KeyValuePair<string, int> source in FrameSources.Floats) {
                first[source.Key] = Size;
                Size += source.Value * (source.Key.StartsWith(PerGroup, StringComparison.Ordinal) ? groups : 1);
            }
        }

        /// <summary>How many floats there are.</summary>
        public int Size { get; }

        /// <summary>The first float of a value, or of a table of groups: "group_matrix_row1".</summary>
        public int First(string name) => first[name];

        /// <summary>
        /// First float and count of "world_row0" or "group_matrix_row1[2]". The pack's check has refused other names.
        /// </summary>
        public int Place(string source, out int floats) {
            int bracket = source.IndexOf('[');
            string name = bracket < 0 ? source : source.Substring(0, bracket);
            string row = bracket < 0 ? "0" : source.Substring(bracket + 1, source.Length - bracket - 2);
            floats = FrameSources.Floats[name];
            return first[name] + floats * int.Parse(row, NumberStyles.None, CultureInfo.InvariantCulture);
        }
    }
}
