using System;
using System.Collections.Generic;
using System.Globalization;
using System.Text.RegularExpressions;

namespace AvatarExport.Core {
    /// <summary>
    /// Live Link Face CSV: a timecode, a count and up to 61 named columns a row. Columns are matched by name in any
    /// order and case; unknown columns are ignored. The timecode is HH:MM:SS:FF.sss, where FF.sss counts frames of a
    /// rate that the file does not store: the smallest common rate above the highest FF.
    /// </summary>
    public static class LiveLinkCsv {
        private const int DefaultRate = 60; // of a file that stays within one second
        private const double Day = 86400; // seconds
        private const double Most = 100; // weights are in 0..1 and angles in -pi..pi; larger values are errors
        private const int Shown = 40; // letters of a wrong field
        private const int ShownHeader = 60;

        private static readonly int[] Rates = { 24, 25, 30, 48, 50, 60, 120, 240 };
        private static readonly Regex Timecode =
            new Regex("^([0-9]{1,2}):([0-9]{1,2}):([0-9]{1,2})[:;]([0-9]{1,3}(?:\\.[0-9]{1,9})?)\\z");
        private static readonly Regex Number = new Regex("^[+-]?([0-9]+\\.?[0-9]*|\\.[0-9]+)([eE][+-]?[0-9]+)?\\z");

        /// <summary>
        /// The recording in the text of a Live Link Face CSV. A row whose BlendShapeCount is 0 has no face: it is left
        /// out and counted. Throws AvatarError of the owner; it names the line (from 1) and the column.
        /// </summary>
        public static Recording Parse(string text, string owner = "the recording") {
            try {
                return Parsed(text);
            } catch (AvatarError error) {
                throw error.Of(owner);
            }
        }

        private static Recording Parsed(string text) {
            CsvRow header = null;
            Columns columns = null;
            var codes = new List<Code>();
            var channels = new List<double>();
            int withoutFace = 0;
            foreach (CsvRow row in Csv.Rows(text.Length == 0 ? "\n" : text)) {
                if (header == null) {
                    header = row;
                    columns = new Columns(header);
                    continue;
                }
                if (row.Fields.Count == 0) continue;
                if (row.Fields.Count != header.Fields.Count) {
                    string found = $"line {row.Line} has {row.Fields.Count} fields";
                    throw new AvatarError($"{found}, but the header has {header.Fields.Count}");
                }
                if (columns.Count >= 0 && row.Fields[columns.Count].Trim() == "0") {
                    withoutFace++;
                    continue;
                }
                codes.Add(CodeOf(row.Fields[columns.Time], row.Line));
                foreach (int at in columns.Channels) channels.Add(at < 0 ? 0 : NumberOf(row, at, header));
            }
            if (codes.Count == 0) throw new AvatarError("has no frame with a face");
            string[] missing = Array.FindAll(Arkit.Channels, name => columns.Channels[Array.IndexOf(Arkit.Channels, name)] < 0);
            return new Recording(TimesOf(codes), channels.ToArray(), missing, withoutFace);
        }

        private static double NumberOf(CsvRow row, int at, CsvRow header) {
            string text = row.Fields[at].Trim();
            double value = double.NaN;
            if (Number.IsMatch(text)) value = JsonNumber.Parse(text, text[0] == '+' ? 1 : 0, text.Length);
            if (Math.Abs(value) <= Most) return value;
            string message = $"line {row.Line}: '{Json.Cut(text, Shown)}' is not a weight or an angle in radians";
            throw new AvatarError(message, null, header.Fields[at].Trim());
        }

        private static Code CodeOf(string text, int line) {
            Match match = Timecode.Match(text.Trim());
            string shown = $"line {line}: '{Json.Cut(text, Shown)}' is not a ";
            if (!match.Success) throw new AvatarError(shown + "timecode HH:MM:SS:FF.sss", null, "Timecode");
            double hours = Part(match, 1), minutes = Part(match, 2), seconds = Part(match, 3), frames = Part(match, 4);
            if (hours > 23 || minutes > 59 || seconds > 59 || frames >= Rates[Rates.Length - 1]) {
                throw new AvatarError(shown + "time of day", null, "Timecode");
            }
            return new Code { Seconds = 3600 * hours + 60 * minutes + seconds, Frames = frames, Line = line };
        }

        private static double Part(Match match, int group) {
            return double.Parse(match.Groups[group].Value, NumberStyles.Float, CultureInfo.InvariantCulture);
        }

        /// <summary>Seconds from the first frame; midnight may be crossed once.</summary>
        private static double[] TimesOf(List<Code> codes) {
            double highest = 0;
            bool crosses = false;
            foreach (Code code in codes) {
                highest = Math.Max(highest, code.Frames);
                crosses |= code.Seconds != codes[0].Seconds;
            }
            int rate = Array.Find(Rates, one => one > highest && (crosses || one >= DefaultRate));
            var times = new double[codes.Count];
            int midnight = 0, midnights = 0;
            for (int i = 0; i < times.Length; i++) {
                times[i] = codes[i].Seconds + codes[i].Frames / rate;
                if (i == 0 || times[i] - times[i - 1] >= -Day / 2) continue;
                midnight = i;
                midnights++;
            }
            for (int i = midnight; i < times.Length && midnights == 1; i++) times[i] += Day;
            double first = times[0];
            for (int i = 1; i < times.Length; i++) {
                if (times[i] < times[i - 1]) {
                    throw new AvatarError($"line {codes[i].Line} is earlier than the one before", null, "Timecode");
                }
            }
            return Array.ConvertAll(times, time => time - first);
        }

        /// <summary>A frame's time of day: whole seconds, frames into the second, and the line that says so.</summary>
        private struct Code {
            public double Seconds;
            public double Frames;
            public int Line;
        }

        /// <summary>Which column holds what; -1: none.</summary>
        private sealed class Columns {
            public readonly int Time;
            public readonly int Count;
            public readonly int[] Channels; // in the order of Arkit.Channels

            public Columns(CsvRow header) {
                var found = new Dictionary<string, int>(StringComparer.Ordinal);
                for (int at = 0; at < header.Fields.Count; at++) {
                    string plain = header.Fields[at].Trim().ToLowerInvariant();
                    string name = plain == "timecode" || plain == "blendshapecount" ? plain : Arkit.ChannelOf(header.Fields[at]);
                    if (name == null) continue;
                    int first;
                    if (found.TryGetValue(name, out first)) {
                        throw new AvatarError($"line {header.Line}: columns {first + 1} and {at + 1} are both {name}");
                    }
                    found[name] = at;
                }
                Time = Place(found, "timecode");
                Count = Place(found, "blendshapecount");
                if (Time < 0) {
                    throw new AvatarError($"line {header.Line}: has no Timecode column; a Live Link Face CSV is needed");
                }
                Channels = Array.ConvertAll(Arkit.Channels, name => Place(found, name));
                if (!Array.TrueForAll(Channels, at => at < 0)) return;
                string listed = Json.Cut(string.Join(", ", header.Fields), ShownHeader);
                throw AvatarError.NoSuch("ARKit column", listed, Arkit.Channels, $"line {header.Line}");
            }

            private static int Place(Dictionary<string, int> found, string name) {
                int at;
                return found.TryGetValue(name, out at) ? at : -1;
            }
        }
    }
}
