using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Text;
using AvatarExport.Core;

namespace AvatarExport.Editor {
    /// <summary>Runs the reference vectors of a folder NAME.reference and writes what was found as a table.</summary>
    public static class ConformFolder {
        private const string Remedy = "choose the folder NAME.reference that `avatar-export pack --reference` writes beside NAME.avatar";
        private const string Suffix = ".reference";

        /// <summary>
        /// The report of all vectors of a folder. `runner` is this machine's GPU. Throws AvatarError that names the file for one
        /// that is missing or unsound.
        /// </summary>
        public static ConformReport Run(string folder, IStageRunner runner) {
            ConformReport report = Driving(folder);
            LoadedAvatar mini = LoadedAvatar.Load(Bytes(folder, "mini.avatar"), "mini.avatar");
            report.Rows.AddRange(Conform.Run(mini, Parsed(folder, "cases.json", "vectors.safetensors"), runner).Rows);
            return report;
        }

        /// <summary>The stages of the CPU, with the whole avatar: the pack that lies beside the folder. Throws AvatarError as Run.</summary>
        public static ConformReport Driving(string folder) {
            string path = folder.TrimEnd('/', '\\');
            if (!path.EndsWith(Suffix, StringComparison.Ordinal)) {
                throw new AvatarError("is no NAME.reference; " + Remedy, Path.GetFileName(path));
            }

            string pack = Path.GetFileName(path.Substring(0, path.Length - Suffix.Length)) + ".avatar";
            LoadedAvatar avatar = LoadedAvatar.Load(Bytes(Path.GetDirectoryName(path), pack), pack);
            if (!File.Exists(Path.Combine(folder, "driving.json"))) return new ConformReport(); // ARKit does not drive it
            return Conform.Run(avatar, Parsed(folder, "driving.json", "driving.safetensors"), null);
        }

        private static Reference Parsed(string folder, string cases, string vectors) {
            return Reference.Parse(Encoding.UTF8.GetString(Bytes(folder, cases)), Bytes(folder, vectors));
        }

        /// <summary>
        /// A line for each stage: its worst output, how much of the tolerance it uses, and in which case. After the first stage that
        /// fails nothing more needs to be read: that stage has the bug.
        /// </summary>
        public static string Table(ConformReport report) {
            var text = new StringBuilder();
            foreach (ConformRow row in WorstOfStages(report)) {
                string used = (100 * row.Verdict.Used).ToString("0.#", CultureInfo.InvariantCulture);
                string verdict = row.Verdict.Passed ? "ok     " : "DIFFERS";
                text.AppendLine($"{verdict} {row.Stage,-10} {row.Output,-16} uses {used} % of its tolerance in case {row.Case}");
            }
            return text.ToString();
        }

        private static List<ConformRow> WorstOfStages(ConformReport report) {
            var worst = new List<ConformRow>();
            foreach (ConformRow row in report.Rows) {
                int known = worst.FindIndex(one => one.Stage == row.Stage);
                if (known < 0) worst.Add(row);
                else if (IsWorse(row.Verdict, worst[known].Verdict)) worst[known] = row;
            }
            return worst;
        }

        private static bool IsWorse(Verdict one, Verdict other) {
            if (one.Passed != other.Passed) return !one.Passed;
            return one.Used > other.Used || double.IsNaN(one.Used);
        }

        private static byte[] Bytes(string folder, string name) {
            try {
                return File.ReadAllBytes(Path.Combine(folder, name));
            } catch (Exception error) when (error is IOException || error is UnauthorizedAccessException) {
                throw new AvatarError("cannot be read; " + Remedy, name);
            }
        }
    }
}
