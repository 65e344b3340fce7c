using System;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>A JSON value and where it stands. Every reader checks it and throws AvatarError with the place.</summary>
    internal sealed class Json {
        public const uint U32Max = uint.MaxValue;
        private const int LettersShown = 40; // of a wrong value in a message
        private static readonly object Missing = new object();

        private readonly Json parent;
        private readonly string place; // in the parent: ".name", "[3]"

        public Json(object value, string path) {
            Value = value;
            place = path;
        }

        private Json(object value, Json parent, string place) {
            Value = value;
            this.parent = parent;
            this.place = place;
        }

        /// <summary>As JsonText parses it.</summary>
        public object Value { get; }

        public bool IsMissing => ReferenceEquals(Value, Missing);

        /// <summary>Such as $.levels[0].count.</summary>
        public string Path => parent == null ? place : parent.Path + place;

        /// <summary>Member `name` of an object; maybe a missing one.</summary>
        public Json At(string name) {
            object member;
            return new Json(Object().TryGetValue(name, out member) ? member : Missing, this, "." + name);
        }

        /// <summary>`read` of member `name`; `otherwise` if it is missing or null.</summary>
        public T Optional<T>(string name, Func<Json, T> read, T otherwise) {
            Json member = At(name);
            return member.IsMissing || member.Value == null ? otherwise : read(member);
        }

        /// <summary>The members of an object in their order.</summary>
        public IEnumerable<KeyValuePair<string, Json>> Entries() {
            return Object().Select(
                member => new KeyValuePair<string, Json>(member.Key, new Json(member.Value, this, "." + member.Key)));
        }

        /// <summary>A list of at least `least` and at most `most` values.</summary>
        public Json[] List(int least = 0, int most = int.MaxValue) {
            List<object> values = Value as List<object>;
            if (values == null) throw Error("a list is needed");
            if (values.Count < least || values.Count > most) {
                throw new AvatarError(Invariant($"has {values.Count} items; {least} to {most} are taken"), null, Path);
            }
            Json[] found = new Json[values.Count];
            for (int i = 0; i < found.Length; i++) {
                found[i] = new Json(values[i], this, "[" + i.ToString(CultureInfo.InvariantCulture) + "]");
            }
            return found;
        }

        /// <summary>Text of `least` to `most` letters.</summary>
        public string Text(int most = int.MaxValue, int least = 0) {
            string text = Value as string;
            if (text == null || text.Length < least || text.Length > most) {
                throw Error(least > 0 ? "a name is needed" : "text is needed");
            }
            return text;
        }

        /// <summary>A name: text that is not empty.</summary>
        public string Name(int most = int.MaxValue) => Text(most, 1);

        /// <summary>Names without duplicates.</summary>
        public string[] Names() {
            string[] found = List().Select(one => one.Name()).ToArray();
            if (new HashSet<string>(found, NameComparer.Instance).Count != found.Length) {
                throw new AvatarError("has a name twice", null, Path);
            }
            return found;
        }

        public string One(params string[] known) {
            if (!known.Contains(Value as string)) {
                string line = Shown(Value) + " is unknown to this reader (it knows " + string.Join(", ", known) + ")";
                throw new AvatarError(line, null, Path);
            }
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
            double number = Value is double ? (double)Value : double.NaN;
            if (double.IsNaN(number) || double.IsInfinity(number)) throw Error("a finite number is needed");
            return number;
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

        /// <summary>The first letters of a text.</summary>
        public static string Cut(string text, int most) => text.Length <= most ? text : text.Substring(0, most);

        private Dictionary<string, object> Object() {
            Dictionary<string, object> members = Value as Dictionary<string, object>;
            if (members == null) throw Error("a JSON object is needed");
            return members;
        }
    }
}
