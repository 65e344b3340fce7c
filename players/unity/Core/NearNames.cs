using System;
using System.Collections.Generic;
using System.Linq;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>Finds names that are like a wrong one.</summary>
    internal static class NearNames {
        private const int Listed = 8;
        private const int Hinted = 3;
        private const int Compared = 1000; // of the known names
        private const double Near = 0.5; // least likeness of a near match
        public const int Longest = 80; // letters of a name that are compared and shown

        /// <summary>What to say after a `name` that is not among the `known` ones.</summary>
        public static string Hint(string name, IList<string> known) {
            string wanted = Shortened(name);
            string[] near = known.Take(Compared)
                .Select(one => new KeyValuePair<string, double>(one, Likeness(wanted, Shortened(one))))
                .Where(row => row.Value >= Near)
                .OrderByDescending(row => row.Value)
                .Take(Hinted).Select(row => row.Key).ToArray();
            if (near.Length > 0) return "did you mean " + string.Join(" or ", near) + "?";
            string listed = string.Join(", ", known.Take(Listed).ToArray()) + (known.Count > Listed ? ", ..." : "");
            return Invariant($"there are {known.Count}: ") + (listed == "" ? "none" : listed);
        }

        private static string Shortened(string name) => Json.Cut(name, Longest).ToLowerInvariant();

        /// <summary>How alike two texts are, 0 to 1: the share of pairs of neighbouring letters that both have.</summary>
        private static double Likeness(string a, string b) {
            if (a == b) return 1;
            Dictionary<string, int> left = Pairs(a);
            Dictionary<string, int> right = Pairs(b);
            int shared = left.Where(one => right.ContainsKey(one.Key)).Sum(one => Math.Min(one.Value, right[one.Key]));
            return 2.0 * shared / Math.Max(a.Length + b.Length + 2, 1);
        }

        /// <summary>The pairs of neighbouring letters of a text, its two ends included, with how often each occurs.</summary>
        private static Dictionary<string, int> Pairs(string text) {
            string padded = " " + text + " ";
            return Enumerable.Range(0, padded.Length - 1)
                .GroupBy(i => padded.Substring(i, 2))
                .ToDictionary(pair => pair.Key, pair => pair.Count());
        }
    }
}
