using System;
using System.Collections.Generic;
using System.Globalization;
using AvatarExport.Core;

namespace AvatarExport.Editor {
    /// <summary>What a person wants to know of an avatar: rows of a label and a text.</summary>
    public static class AvatarFacts {
        /// <summary>The rows that the inspector of a file shows.</summary>
        public static List<KeyValuePair<string, string>> Of(LoadedAvatar avatar) {
            var rows = new List<KeyValuePair<string, string>>();
            Add(rows, "Name", avatar.Name);
            Add(rows, "Splats", Number(avatar.Levels[0].Count));
            Add(rows, "Levels", Levels(avatar));
            Add(rows, "File", Megabytes(avatar.Bytes));
            Add(rows, "Expressions", Number(avatar.Expressions.Length));
            if (avatar.Eyelids.Length > 0) Add(rows, "Eyelids", string.Join(", ", avatar.Eyelids));
            Add(rows, "Bones", avatar.Skeleton == null ? "none" : Number(avatar.Skeleton.Names.Length));
            Add(rows, "ARKit input", avatar.Driving == null ? "no: the file has no driving" : "yes");
            Add(rows, "Frame", avatar.Handedness == "left" ? "left-handed, as Unity" : "right-handed, mirrored on import");
            Add(rows, "Licence", avatar.License ?? "not stated: ask before you publish");
            Add(rows, "Consent", avatar.Consent ?? "not stated: ask before you publish");
            return rows;
        }

        /// <summary>A line for each clip: its name, seconds and frame rate.</summary>
        public static List<string> Clips(LoadedAvatar avatar) {
            return new List<string>(Array.ConvertAll(avatar.Clips, clip => Invariant(
                "{0}: {1:0.##} s, {2:0.##} frames a second", clip.Name, clip.Seconds, clip.Fps)));
        }

        /// <summary>A line for each expression: its name and its trained range.</summary>
        public static List<string> Ranges(LoadedAvatar avatar) {
            return new List<string>(Array.ConvertAll(avatar.Expressions, one => Invariant(
                "{0}: trained from {1:0.##} to {2:0.##}", one.Name, one.Low, one.High)));
        }

        private static string Levels(LoadedAvatar avatar) {
            var parts = new List<string>();
            foreach (LevelInfo level in avatar.Levels) {
                string height = level.HeightPx.HasValue ? Invariant(" up to {0:0} pixels of height", level.HeightPx.Value) : "";
                parts.Add(Number(level.Count) + height);
            }
            return string.Join("; ", parts.ToArray());
        }

        private static void Add(List<KeyValuePair<string, string>> rows, string label, string text) {
            rows.Add(new KeyValuePair<string, string>(label, AvatarError.Plain(text)));
        }

        private static string Number(int count) => count.ToString("N0", CultureInfo.InvariantCulture);

        private static string Megabytes(int bytes) => Invariant("{0:0.00} MB", bytes / 1e6);

        private static string Invariant(string format, params object[] values) {
            return AvatarError.Plain(string.Format(CultureInfo.InvariantCulture, format, values));
        }
    }
}
