using System.Collections.Generic;
using System.Globalization;

namespace AvatarExport.Editor
{
    /// <summary>What a person wants to know of an avatar: rows of a label and a text.</summary>
    public static class AvatarFacts
    {
        /// <summary>The rows that the inspector of a file shows.</summary>
        public static List<KeyValuePair<string, string>> Of(Core.Avatar avatar)
        {
            var rows = new List<KeyValuePair<string, string>>();
            Add(rows, "Name", avatar.Name);
            Add(rows, "Splats", Number(avatar.Levels[0].Count));
            Add(rows, "Levels", Levels(avatar));
            Add(rows, "File", Megabytes(avatar.Bytes));
            Add(rows, "Expressions", Number(avatar.Expressions.Length));
            if (avatar.LateMorphs.Length > 0) Add(rows, "Eyelids", string.Join(", ", avatar.LateMorphs));
            Add(rows, "Bones", avatar.Skeleton == null ? "none" : Number(avatar.Skeleton.Names.Length));
            Add(rows, "ARKit input", avatar.Driving == null ? "no: the file has no driving" : "yes");
            Add(rows, "Frame", avatar.Handedness == "left" ? "left-handed, as Unity" : "right-handed, mirrored on import");
            Add(rows, "Licence", avatar.License ?? "not stated: ask before you publish");
            Add(rows, "Consent", avatar.Consent ?? "not stated: ask before you publish");
            return rows;
        }

        /// <summary>A line for each clip: its name, seconds and frame rate.</summary>
        public static List<string> Clips(Core.Avatar avatar)
        {
            var lines = new List<string>();
            for (int i = 0; i < avatar.Clips.Length; i++)
            {
                var clip = new Core.Clip(avatar, i);
                lines.Add(Invariant("{0}: {1:0.##} s, {2:0.##} frames a second", clip.Name, clip.Seconds, clip.Fps));
            }
            return lines;
        }

        /// <summary>A line for each expression: its name and its trained range.</summary>
        public static List<string> Ranges(Core.Avatar avatar)
        {
            var lines = new List<string>();
            foreach (Core.Expression one in avatar.Expressions)
            {
                lines.Add(Invariant("{0}: trained from {1:0.##} to {2:0.##}", one.Name, one.Low, one.High));
            }
            return lines;
        }

        private static string Levels(Core.Avatar avatar)
        {
            var parts = new List<string>();
            foreach (Core.LevelInfo level in avatar.Levels)
            {
                string height = level.HeightPx.HasValue ? Invariant(" up to {0:0} pixels of height", level.HeightPx.Value) : "";
                parts.Add(Number(level.Count) + height);
            }
            return string.Join("; ", parts.ToArray());
        }

        private static void Add(List<KeyValuePair<string, string>> rows, string label, string text)
        {
            rows.Add(new KeyValuePair<string, string>(label, text));
        }

        private static string Number(int count)
        {
            return count.ToString("N0", CultureInfo.InvariantCulture);
        }

        private static string Megabytes(int bytes)
        {
            return Invariant("{0:0.00} MB", bytes / 1e6);
        }

        private static string Invariant(string format, params object[] values)
        {
            return string.Format(CultureInfo.InvariantCulture, format, values);
        }
    }
}
