using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>What a pointer section says of its rows.</summary>
    internal sealed class PointerRows {
        public bool Rises; // it begins with 0 and never falls
        public long Last; // its last element
        public long Longest; // entries of the longest row
    }

    /// <summary>A static buffer: where its sections begin, and what is found in them. Each is searched once.</summary>
    internal sealed class Packed {
        public const double MostFloat32 = 3.4028234663852886e38;

        public readonly Dictionary<string, int> Offsets; // section -> its first word
        public readonly int Words;
        private readonly Dictionary<string, Section> sections = new Dictionary<string, Section>();
        private readonly Dictionary<string, long> largest = new Dictionary<string, long>();
        private readonly Dictionary<string, double> sizes = new Dictionary<string, double>();
        private readonly Dictionary<string, PointerRows> walked = new Dictionary<string, PointerRows>();

        public Packed(ProgramBuffer buffer) {
            Offsets = buffer.Offsets();
            Words = buffer.Bytes / ProgramBuffer.Word;
            foreach (Section section in buffer.Sections) sections[section.Name] = section;
        }

        /// <summary>The section of that name; or null.</summary>
        public Section Find(string name) {
            Section found;
            return sections.TryGetValue(name, out found) ? found : null;
        }

        /// <summary>The largest element; -1 of none.</summary>
        public long Largest(Section section) {
            long most;
            if (largest.TryGetValue(section.Name, out most)) return most;
            most = -1;
            Elements elements = section.Elements;
            for (int i = 0; i < elements.Length; i++) most = Math.Max(most, elements[i]);
            largest.Add(section.Name, most);
            return most;
        }

        /// <summary>Whether all elements, float32 by their bits, are finite and no larger than `most`.</summary>
        public bool IsFinite(Section section, double most = MostFloat32) {
            double size;
            if (!sizes.TryGetValue(section.Name, out size)) {
                size = section.Elements.Bits == 32 ? LargestSize(section.Elements) : double.PositiveInfinity;
                sizes.Add(section.Name, size);
            }
            return size <= most;
        }

        /// <summary>The rows of a pointer section.</summary>
        public PointerRows Rows(Section section) {
            PointerRows rows;
            if (walked.TryGetValue(section.Name, out rows)) return rows;
            rows = Walk(section.Elements);
            walked.Add(section.Name, rows);
            return rows;
        }

        private static double LargestSize(Elements elements) {
            double most = 0;
            for (int i = 0; i < elements.Length; i++) {
                double size = Math.Abs((double)elements.FloatAt(i));
                if (!(size <= MostFloat32)) return double.PositiveInfinity; // NaN compares false
                if (size > most) most = size;
            }
            return most;
        }

        private static PointerRows Walk(Elements elements) {
            PointerRows rows = new PointerRows();
            if (elements.Length == 0) return rows;
            rows.Last = elements[elements.Length - 1];
            rows.Rises = elements[0] == 0;
            for (int row = 1; row < elements.Length; row++) {
                long entries = (long)elements[row] - elements[row - 1];
                if (entries < 0) rows.Rises = false;
                rows.Longest = Math.Max(rows.Longest, entries);
            }
            return rows;
        }
    }
}
