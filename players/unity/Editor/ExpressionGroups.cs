using System;
using System.Collections.Generic;

namespace AvatarExport.Editor {
    /// <summary>Names that belong together in a list of sliders.</summary>
    public sealed class ExpressionGroup {
        /// <summary>What its heading says.</summary>
        public string Title;

        /// <summary>Indices into the names that were given, in their order.</summary>
        public int[] Members;
    }

    /// <summary>Sorts names such as mouthSmileLeft into groups such as Mouth.</summary>
    public static class ExpressionGroups {
        /// <summary>The heading of names that share their first word with no other.</summary>
        public const string Rest = "Other";

        /// <summary>
        /// Groups by the first word of each name, in the order of their first member; names without companions come last.
        /// Only names that contain `search`, in any case, are kept.
        /// </summary>
        public static ExpressionGroup[] Of(IReadOnlyList<string> names, string search) {
            var members = new Dictionary<string, List<int>>();
            var titles = new List<string>();
            for (int i = 0; i < names.Count; i++) {
                string title = Title(names[i]);
                if (!members.ContainsKey(title)) {
                    members[title] = new List<int>();
                    titles.Add(title);
                }
                members[title].Add(i);
            }
            var alone = new List<int>();
            var groups = new List<ExpressionGroup>();
            foreach (string title in titles) {
                if (members[title].Count == 1) alone.Add(members[title][0]);
                else Add(groups, title, members[title], names, search);
            }
            Add(groups, Rest, alone, names, search);
            return groups.ToArray();
        }

        private static void Add(List<ExpressionGroup> groups, string title, List<int> all, IReadOnlyList<string> names, string search) {
            int[] kept = all.FindAll(index => Matches(names[index], search)).ToArray();
            if (kept.Length > 0) groups.Add(new ExpressionGroup { Title = title, Members = kept });
        }

        private static bool Matches(string name, string search) {
            return string.IsNullOrEmpty(search) || name.IndexOf(search.Trim(), StringComparison.OrdinalIgnoreCase) >= 0;
        }

        /// <summary>mouthSmileLeft, mouth_smile and mouth 1 are all Mouth.</summary>
        private static string Title(string name) {
            int end = 1;
            while (end < name.Length && char.IsLower(name[end])) end++;
            return char.ToUpperInvariant(name[0]) + name.Substring(1, end - 1);
        }
    }
}
