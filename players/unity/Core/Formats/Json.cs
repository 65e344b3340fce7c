using System;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>A JSON value and where it stands. Every reader checks its kind and throws AvatarError with the place.</summary>
    internal sealed class Json {
        public const uint U32Max = uint.MaxValue;
        private const int LettersShown = 40; // of a wrong value in a message
        private const int LettersOfName = 80; // in a place
        private static readonly object Missing = new object();

        private readonly Json parent;
        private readonly string name; // in the parent, or the whole place; null in a list
        private readonly int index;

        public Json(object value, string path) {
            Value = value;
            name = path;
        }

        private Json(object value, Json parent, string name, int index = 0) {
            Value = value;
            this.parent = parent;
            this.name = name;
            this.index = index;
        }

        /// <summary>As JsonText parses it.</summary>
        public object Value { get; }

        public bool IsMissing => ReferenceEquals(Value, Missing);

        /// <summary>Such as $.levels[0].count.</summary>
        public string Path {
            get {
                if (parent == null) return name;
                return parent.Path + (name == null ? Invariant($"[{index}]") : "." + Cut(name, LettersOfName));
            }
        }

        /// <summary>Member `name` of an object; maybe a missing one.</summary>
        public Json At(string name) {
            object member;
            return new Json(Object().TryGetValue(name, out member) ? member : Missing, this, name);
        }

        /// <summary>`read` of member `name`; `otherwise` if it is missing or null.</summary>
        public T Optional<T>(string name, Func<Json, T> read, T otherwise) {
            Json member = At(name);
            return member.IsMissing || member.Value == null ? otherwise : read(member);
        }

        /// <summary>The members of an object in their order.</summary>
        public IEnumerable<KeyValuePair<string, Json>> Entries() {
            return Object().Select(
                member => new KeyValuePair<string, Json>(member.Key, new Json(member.Value, this, member.Key)));
        }

        /// <summary>A list of at least `least` and at most `most` values.</summary>
        public Json[] List(int least = 0, int most = int.MaxValue) {
            List<object> values = Value as List<object>;
            if (values == null) throw Error("a list is needed");
            if (values.Count < least || values.Count > most) {
                string taken = most == int.MaxValue ? Invariant($"at least {least}") : Invariant($"{least} to {most}");
                throw new AvatarError(Invariant($"has {values.Count} items; {taken} are taken"), null, Path);
            }
            Json[] found = new Json[values.Count];
            for (int i = 0; i < found.Length; i++) found[i] = new Json(values[i], this, null, i);
            return found;
        }

        public string Text() {
            if (!(Value is string)) throw Error("text is needed");
            return (string)Value;
        }

        public string[] Names() => List().Select(one => one.Text()).ToArray();

        public string One(params string[] known) {
            if (!known.Contains(Value as string)) throw Unknown(known);
            return (string)Value;
        }

        public long Whole(long least = 0, long most = U32Max) {
            double number = Value is double ? (double)Value : double.NaN;
            if (!(number >= least && number <= most && Math.Floor(number) == number)) {
                throw Error(Invariant($"a whole number of {least} to {most} is needed"));
            }
            return (long)number;
        }

        /// <summary>A whole number of 31 bits.</summary>
        public int Int(int least = 0, int most = int.MaxValue) => (int)Whole(least, most);

        public double Number() {
            if (!(Value is double)) throw Error("a finite number is needed");
            return (double)Value;
        }

        public bool Flag() {
            if (!(Value is bool)) throw Error("true or false is needed");
            return (bool)Value;
        }

        public double[] Vector() => List(3, 3).Select(one => one.Number()).ToArray();

        /// <summary>The error for a value of another kind.</summary>
        public AvatarError Error(string needed) {
            string found = IsMissing ? "is missing" : "is " + Shown(Value);
            return new AvatarError(found + "; " + needed, null, Path);
        }

        /// <summary>The error for a value that is none of the `known` ones.</summary>
        public AvatarError Unknown(IEnumerable<object> known) {
            string listed = string.Join(", ", known.Select(one => one as string ?? Shown(one)).ToArray());
            return new AvatarError(Shown(Value) + " is unknown to this reader (it knows " + listed + ")", null, Path);
        }

        /// <summary>A wrong value as a person may read it: short.</summary>
        public static string Shown(object value) {
            if (value is string) return "'" + Cut((string)value, LettersShown) + "'";
            if (value is bool) return (bool)value ? "true" : "false";
            if (value is double) return Shown((double)value);
            if (value is List<object>) return "a list";
            return value == null ? "null" : "an object";
        }

        /// <summary>A number with as many digits as it has.</summary>
        public static string Shown(double value) => value.ToString("R", CultureInfo.InvariantCulture);

        /// <summary>The first letters of a text; no half of a surrogate pair.</summary>
        public static string Cut(string text, int most) {
            if (text.Length <= most) return text;
            return text.Substring(0, char.IsHighSurrogate(text[most - 1]) ? most - 1 : most);
        }

        private Dictionary<string, object> Object() {
            Dictionary<string, object> members = Value as Dictionary<string, object>;
            if (members == null) throw Error("a JSON object is needed");
            return members;
        }
    }
}
