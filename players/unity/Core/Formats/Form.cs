using System;
using System.Collections.Generic;
using System.Linq;
using System.Text.RegularExpressions;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>
    /// What a JSON value must be: a JSON Schema of few keywords, read once. A keyword concerns values of its kind alone.
    /// </summary>
    internal sealed class Form {
        public static readonly Regex Version = new Regex(@"^(0|[1-9][0-9]{0,8})\.(0|[1-9][0-9]{0,8})\z");
        private static readonly Regex Sha256 = new Regex(@"^[0-9a-f]{64}\z");
        private const int Whole = 32, Broken = 64; // kinds of numbers
        private static readonly Dictionary<string, int> Kinds = new Dictionary<string, int> {
            ["object"] = 1, ["array"] = 2, ["string"] = 4, ["boolean"] = 8, ["null"] = 16,
            ["integer"] = Whole, ["number"] = Whole | Broken,
        };
        private static readonly Dictionary<string, string> Words = new Dictionary<string, string> {
            ["object"] = "a JSON object", ["array"] = "a list", ["string"] = "text", ["boolean"] = "true or false",
            ["null"] = "null", ["integer"] = "a whole number", ["number"] = "a finite number",
        };
        private static readonly KeyValuePair<string, Json>[] None = new KeyValuePair<string, Json>[0];

        private readonly Dictionary<string, Form> properties = new Dictionary<string, Form>(NameComparer.Instance);
        private int kinds = -1; // bits of Kinds that are taken
        private string needed; // in words
        private string[] required;
        private Form others; // of properties; null: any
        private Form items; // null: any
        private double leastItems, mostItems, leastLetters, mostLetters, minimum, maximum, above;
        private object[] known; // null: all
        private bool isUnique;
        private string format;
        private Form[] choices; // asked last
        private string choice; // what is wrong where none fits; null: what its own kind says

        /// <summary>The form of a text.</summary>
        public static Form Parse(string text) {
            Json said = new Json(JsonText.Parse(text), "form");
            KeyValuePair<string, Json>[] defined = MembersOf(said, "$defs");
            Dictionary<string, Form> named = defined.ToDictionary(one => "#/$defs/" + one.Key, one => new Form());
            foreach (KeyValuePair<string, Json> one in defined) named["#/$defs/" + one.Key].Fill(one.Value, named);
            return Of(said, named);
        }

        private static Form Of(Json said, Dictionary<string, Form> named) {
            Json name = said.At("$ref");
            return name.IsMissing ? new Form().Fill(said, named) : named[name.Text()];
        }

        private static KeyValuePair<string, Json>[] MembersOf(Json said, string name) {
            return said.Optional(name, one => one.Entries().ToArray(), None);
        }

        private Form Fill(Json said, Dictionary<string, Form> named) {
            Func<string, double, double> limit = (name, otherwise) => said.Optional(name, one => one.Number(), otherwise);
            Json type = said.At("type"), rest = said.At("additionalProperties"), only = said.At("const");
            foreach (KeyValuePair<string, Json> one in MembersOf(said, "properties")) {
                properties.Add(one.Key, Of(one.Value, named));
            }
            required = said.Optional("required", one => one.Names(), new string[0]);
            others = rest.IsMissing ? null : Of(rest, named);
            items = said.Optional("items", one => Of(one, named), null);
            leastItems = limit("minItems", 0);
            mostItems = limit("maxItems", double.PositiveInfinity);
            leastLetters = limit("minLength", 0);
            mostLetters = limit("maxLength", double.PositiveInfinity);
            minimum = limit("minimum", double.NegativeInfinity);
            maximum = limit("maximum", double.PositiveInfinity);
            above = limit("exclusiveMinimum", double.NegativeInfinity);
            known = said.Optional("enum", all => all.List().Select(one => one.Value).ToArray(), null);
            if (!only.IsMissing) known = new[] { only.Value };
            isUnique = said.Optional("uniqueItems", one => one.Flag(), false);
            format = said.Optional("format", one => one.Text(), null);
            choices = said.Optional("anyOf", all => all.List().Select(one => Of(one, named)).ToArray(), null);
            choice = said.Optional("description", one => one.Text(), null);
            string[] types = type.IsMissing ? new string[0] : type.Value is string ? new[] { type.Text() } : type.Names();
            if (types.Length > 0) kinds = types.Aggregate(0, (bits, one) => bits | Kinds[one]);
            needed = Needed(types) + " is needed";
            return this;
        }

        private string Needed(string[] types) {
            IEnumerable<string> words = types.Select(one => one == "string" && leastLetters > 0 ? "a name" : Words[one]);
            if (known != null) words = known.Select(one => one as string ?? Json.Shown(one));
            return string.Join(" or ", words.DefaultIfEmpty("a value").ToArray());
        }

        /// <summary>What is wrong with a value first; null: nothing.</summary>
        public AvatarError Fault(Json said) {
            object value = said.Value;
            int kind = KindOf(value);
            if ((kinds & kind) == 0) return said.Error(needed);
            if (known != null && !known.Contains(value)) return said.Unknown(known);
            AvatarError fault = FaultOfKind(said, value);
            return fault != null || choices == null ? fault : FaultOfChoices(said, kind);
        }

        private AvatarError FaultOfKind(Json said, object value) {
            if (value is Dictionary<string, object> members) return FaultOfMembers(said, members);
            if (value is List<object> list) return FaultOfList(said, list);
            if (value is string text) return FaultOfText(said, text);
            return value is double number ? FaultOfNumber(said, number) : null;
        }

        private static int KindOf(object value) {
            if (value is double number) return Math.Floor(number) == number ? Whole : Broken;
            if (value is string) return Kinds["string"];
            if (value is Dictionary<string, object>) return Kinds["object"];
            if (value is List<object>) return Kinds["array"];
            return Kinds[value is bool ? "boolean" : "null"];
        }

        /// <summary>Null if one fits.</summary>
        private AvatarError FaultOfChoices(Json said, int kind) {
            AvatarError first = null;
            foreach (Form one in choices) {
                if ((one.kinds & kind) == 0) continue;
                AvatarError fault = one.Fault(said);
                if (fault == null) return null;
                first = first ?? fault;
            }
            if (choice != null) return new AvatarError(choice, null, said.Path);
            return first ?? said.Error(string.Join(", or ", choices.Select(one => one.needed).ToArray()));
        }

        private AvatarError FaultOfMembers(Json said, Dictionary<string, object> members) {
            foreach (string name in required) {
                if (members.ContainsKey(name)) continue;
                Form lost;
                return said.At(name).Error(properties.TryGetValue(name, out lost) ? lost.needed : "it is needed");
            }
            if (properties.Count == 0 && others == null) return null;
            foreach (KeyValuePair<string, Json> one in said.Entries()) {
                Form form;
                if (!properties.TryGetValue(one.Key, out form)) form = others;
                AvatarError fault = form == null ? null : form.Fault(one.Value);
                if (fault != null) return fault;
            }
            return null;
        }

        private AvatarError FaultOfList(Json said, List<object> list) {
            if (list.Count < leastItems || list.Count > mostItems) return Outside(said, "items", list.Count, leastItems, mostItems);
            AvatarError fault = items == null ? null : said.List().Select(items.Fault).FirstOrDefault(one => one != null);
            if (fault != null || !isUnique) return fault;
            HashSet<string> names = new HashSet<string>(list.OfType<string>(), NameComparer.Instance);
            return names.Count == list.Count ? null : new AvatarError("has a name twice", null, said.Path);
        }

        private AvatarError FaultOfText(Json said, string text) {
            if (format == "version" && !Version.IsMatch(text)) return said.Error("\"MAJOR.MINOR\" is needed");
            if (format == "sha256" && !Sha256.IsMatch(text)) return said.Error("64 hexadecimal digits are needed");
            if (text.Length < leastLetters) return said.Error(needed);
            if (text.Length <= mostLetters) return null;
            int letters = text.Length - text.Count(char.IsLowSurrogate);
            return letters > mostLetters ? Outside(said, "letters", letters, leastLetters, mostLetters) : null;
        }

        private AvatarError FaultOfNumber(Json said, double number) {
            if (number >= minimum && number <= maximum && number > above) return null;
            string least = double.IsInfinity(above) ? "at least " + Json.Shown(minimum) : "more than " + Json.Shown(above);
            if (double.IsInfinity(maximum)) return said.Error(least + " is needed");
            return said.Error(Json.Shown(minimum) + " to " + Json.Shown(maximum) + " is needed");
        }

        private static AvatarError Outside(Json said, string what, int count, double least, double most) {
            string taken = double.IsInfinity(most) ? Invariant($"at least {least} are needed") : Invariant($"{least} to {most} are taken");
            return new AvatarError(Invariant($"has {count} {what}; ") + taken, null, said.Path);
        }
    }
}
