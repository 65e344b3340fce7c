using System;
using System.Collections.Generic;
using System.Globalization;
using System.Text;

namespace AvatarExport.Core {
    /// <summary>
    /// Parses JSON text by RFC 8259. It refuses a name that an object has twice, half surrogates, numbers that float64 cannot
    /// hold, and what would take much memory or stack. Values are null, bool, double, string, List of object, Dictionary of
    /// string to object.
    /// </summary>
    internal sealed class JsonText {
        private const int MostDepth = 64; // lists and objects inside each other
        private const int MostValues = 1 << 21;
        private const long MostWhole = 1L << 53; // beyond it, float64 skips whole numbers

        private readonly string text;
        private readonly StringBuilder letters = new StringBuilder();
        private int at;
        private int depth;
        private int values;

        private JsonText(string text) {
            this.text = text;
        }

        /// <summary>The value of a whole text. Throws FormatException, which says where it is wrong.</summary>
        public static object Parse(string text) {
            JsonText parser = new JsonText(text);
            object value = parser.Value();
            parser.SkipSpace();
            if (parser.at < text.Length) throw parser.Error("more text follows the value");
            return value;
        }

        private FormatException Error(string what) {
            return new FormatException(what + " at letter " + at.ToString(CultureInfo.InvariantCulture));
        }

        private void SkipSpace() {
            while (at < text.Length && (text[at] == ' ' || text[at] == '\n' || text[at] == '\r' || text[at] == '\t')) at++;
        }

        private char Next() {
            SkipSpace();
            if (at >= text.Length) throw Error("the text ends too early");
            return text[at];
        }

        private object Value() {
            if (++values > MostValues) throw Error("more than " + MostValues + " values");
            switch (Next()) {
                case '{': return Nested(true);
                case '[': return Nested(false);
                case '"': return Text();
                case 't': return Word("true", true);
                case 'f': return Word("false", false);
                case 'n': return Word("null", null);
                default: return Number();
            }
        }

        private object Nested(bool isObject) {
            if (++depth > MostDepth) throw Error("more than " + MostDepth + " values inside each other");
            at++;
            object made = isObject ? (object)Members() : Items();
            depth--;
            return made;
        }

        private List<object> Items() {
            List<object> items = new List<object>();
            if (Ends(']')) return items;
            do items.Add(Value());
            while (Goes(']'));
            return items;
        }

        private Dictionary<string, object> Members() {
            Dictionary<string, object> members = new Dictionary<string, object>(NameComparer.Instance);
            if (Ends('}')) return members;
            do {
                if (Next() != '"') throw Error("a name is needed");
                string name = Text();
                if (members.ContainsKey(name)) throw Error("a name stands twice");
                if (Next() != ':') throw Error("a colon is needed");
                at++;
                members.Add(name, Value());
            } while (Goes('}'));
            return members;
        }

        private bool Ends(char end) {
            if (Next() != end) return false;
            at++;
            return true;
        }

        /// <summary>Whether another item follows after a comma.</summary>
        private bool Goes(char end) {
            char next = Next();
            if (next != ',' && next != end) throw Error("a comma or " + end + " is needed");
            at++;
            return next == ',';
        }

        private object Word(string word, object value) {
            if (string.CompareOrdinal(text, at, word, 0, word.Length) != 0) throw Error("an unknown word");
            at += word.Length;
            return value;
        }

        private string Text() {
            int begin = ++at;
            letters.Length = 0;
            while (true) {
                if (at >= text.Length) throw Error("a text without end");
                char letter = text[at];
                if (letter == '"') break;
                if (letter < ' ') throw Error("a control letter");
                if (letter == '\\') {
                    letters.Append(text, begin, at - begin);
                    AppendEscaped();
                    begin = at;
                } else {
                    at++;
                }
            }
            string last = text.Substring(begin, at - begin);
            at++;
            return letters.Length == 0 ? last : letters.Append(last).ToString();
        }

        private void AppendEscaped() {
            char letter = Escaped();
            letters.Append(letter);
            if (!char.IsSurrogate(letter)) return;
            char second = at < text.Length && text[at] == '\\' ? Escaped() : ' ';
            if (!char.IsSurrogatePair(letter, second)) throw Error("half of a surrogate pair");
            letters.Append(second);
        }

        private char Escaped() {
            at++;
            if (at >= text.Length) throw Error("a text without end");
            char kind = text[at++];
            switch (kind) {
                case '"': case '\\': case '/': return kind;
                case 'b': return '\b';
                case 'f': return '\f';
                case 'n': return '\n';
                case 'r': return '\r';
                case 't': return '\t';
                case 'u': return Unicode();
                default: throw Error("an unknown escape");
            }
        }

        private char Unicode() {
            int code = 0;
            for (int end = at + 4; at < end; at++) {
                int digit = at < text.Length ? Hex(text[at]) : -1;
                if (digit < 0) throw Error("four hexadecimal digits are needed");
                code = 16 * code + digit;
            }
            if (code == 0) throw Error("the letter U+0000");
            return (char)code;
        }

        private static int Hex(char letter) {
            if (letter >= '0' && letter <= '9') return letter - '0';
            if (letter >= 'a' && letter <= 'f') return letter - 'a' + 10;
            return letter >= 'A' && letter <= 'F' ? letter - 'A' + 10 : -1;
        }

        private object Number() {
            int begin = at;
            if (text[at] == '-') at++;
            if (at < text.Length && text[at] == '0') at++;
            else Digits();
            int end = at;
            if (at < text.Length && text[at] == '.') {
                at++;
                Digits();
            }
            if (at < text.Length && (text[at] == 'e' || text[at] == 'E')) {
                at++;
                if (at < text.Length && (text[at] == '+' || text[at] == '-')) at++;
                Digits();
            }
            if (at == end) return Whole(begin);
            double number = JsonNumber.Parse(text, begin, at);
            if (double.IsInfinity(number)) throw Error("a number beyond float64");
            return number == 0 ? 0 : number; // -0.0 is 0
        }

        private double Whole(int begin) {
            long size = 0;
            for (int i = text[begin] == '-' ? begin + 1 : begin; i < at; i++) {
                size = 10 * size + (text[i] - '0');
                if (size > MostWhole) throw Error("a whole number beyond 2^53");
            }
            return text[begin] == '-' ? -size : size;
        }

        private void Digits() {
            int begin = at;
            while (at < text.Length && text[at] >= '0' && text[at] <= '9') at++;
            if (at == begin) throw Error("a value is needed");
        }
    }

    /// <summary>Compares names by letters. Its hashes differ from run to run, so no file can make them collide.</summary>
    internal sealed class NameComparer : IEqualityComparer<string> {
        public static readonly NameComparer Instance = new NameComparer();
        private readonly uint seed = (uint)Guid.NewGuid().GetHashCode();

        public bool Equals(string one, string other) => string.Equals(one, other, StringComparison.Ordinal);

        public int GetHashCode(string name) {
            unchecked {
                uint hash = seed;
                foreach (char letter in name) {
                    hash = (hash ^ letter) * 0x9e3779b1;
                    hash ^= hash >> 15;
                }
                return (int)hash;
            }
        }
    }
}
