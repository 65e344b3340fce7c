using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>An avatar or a pack that cannot be used. One line: whose file, which field, what, what to do.</summary>
    public sealed class AvatarError : Exception {
        /// <summary>`reason` says what is wrong and what to do; `field` where, `owner` whose it is.</summary>
        public AvatarError(string reason, string owner = null, string field = null)
            : base(Line(reason, owner, field)) {
            Reason = reason;
            Owner = owner;
            Field = field;
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

        private static string Line(string reason, string owner, string field) {
            string line = reason;
            if (!string.IsNullOrEmpty(field)) line = field + ": " + line;
            if (!string.IsNullOrEmpty(owner)) line = owner + ": " + line;
            return string.Join(" ", line.Split((char[])null, StringSplitOptions.RemoveEmptyEntries));
        }
    }
}
