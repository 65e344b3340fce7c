using System;
using System.Collections.Generic;
using System.Globalization;
using System.Text;

namespace AvatarExport.Core {
    /// <summary>An avatar or a pack that cannot be used. One line: whose file, which field, what, what to do.</summary>
    public sealed class AvatarError : Exception {
        private const int MostLetters = 300; // of a reason, and of a field

        /// <summary>`reason` says what is wrong and what to do; `field` where, `owner` whose it is.</summary>
        public AvatarError(string reason, string owner = null, string field = null)
            : base(Begin(Plain(owner)) + Begin(Short(field)) + Short(reason)) {
            Reason = Short(reason);
            Owner = Plain(owner);
            Field = Short(field);
        }

        /// <summary>The message without owner and field.</summary>
        public string Reason { get; }

        /// <summary>Whose avatar or file it is; or null.</summary>
        public string Owner { get; }

        /// <summary>Which field of it; or null.</summary>
        public string Field { get; }

        /// <summary>The same error of an owner, for what was thrown where the owner is not known.</summary>
        public AvatarError Of(string owner) => new AvatarError(Reason, owner, Field);

        /// <summary>The error for a `name` that is not among the `known` names of a `what`. It lists near matches.</summary>
        public static AvatarError NoSuch(
            string what, string name, IList<string> known, string field = null, string owner = null) {
            string article = "aeiouAEIOU".IndexOf(what[0]) >= 0 ? "an" : "a";
            string shown = Json.Cut(name, NearNames.Longest);
            return new AvatarError(
                "'" + shown + "' is not " + article + " " + what + "; " + NearNames.Hint(name, known), owner, field);
        }

        /// <summary>
        /// A text of a pack in one line: control letters, and letters that no one sees or that turn what follows, are
        /// written as \u001b.
        /// </summary>
        public static string Plain(string text) {
            StringBuilder made = null;
            for (int i = 0; text != null && i < text.Length; i++) {
                if (made == null && IsHidden(text[i])) made = new StringBuilder(text, 0, i, 2 * text.Length);
                if (made == null) continue;
                if (!IsHidden(text[i])) made.Append(text[i]);
                else made.Append("\\u").Append(((int)text[i]).ToString("x4", CultureInfo.InvariantCulture));
            }
            return made == null ? text : made.ToString();
        }

        private static bool IsHidden(char letter) {
            return letter < ' ' || (letter >= '\u007f' && letter <= '\u009f') || letter == '\u061c' || letter == '\ufeff'
                || (letter >= '\u200b' && letter <= '\u200f') || (letter >= '\u2028' && letter <= '\u202e')
                || (letter >= '\u2066' && letter <= '\u2069');
        }

        private static string Short(string text) => Plain(text == null ? null : Json.Cut(text, MostLetters));

        private static string Begin(string place) => string.IsNullOrEmpty(place) ? "" : place + ": ";
    }
}
