using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Text;

namespace AvatarExport.Play {
    /// <summary>
    /// Asks the Python process at the other end of standard input and output: a line of JSON, then bytes. Every
    /// question is answered by its number of bytes.
    /// </summary>
    internal sealed class Pipe {
        private static readonly uint[] Nothing = new uint[0];

        private readonly Stream input = Console.OpenStandardInput();
        private readonly Stream output = new BufferedStream(Console.OpenStandardOutput(), 1 << 20);

        /// <summary>Sends a question; fills the answer.</summary>
        public void Ask(string json, uint[] answer) {
            Tell(json);
            output.Flush();
            byte[] bytes = new BinaryReader(input).ReadBytes(4 * answer.Length);
            if (bytes.Length < 4 * answer.Length) throw new EndOfStreamException("the other end is gone");
            Buffer.BlockCopy(bytes, 0, answer, 0, bytes.Length);
        }

        /// <summary>Sends a statement, with words.</summary>
        public void Tell(string json, uint[] words = null) {
            byte[] line = Encoding.UTF8.GetBytes(json + "\n"), bytes = new byte[4 * (words ?? Nothing).Length];
            output.Write(line, 0, line.Length);
            Buffer.BlockCopy(words ?? Nothing, 0, bytes, 0, bytes.Length);
            output.Write(bytes, 0, bytes.Length);
        }

        public void Close() => output.Flush();

        /// <summary>A JSON object of names and values: text, numbers, flags, lists, and objects that are dictionaries.</summary>
        public static string Json(params object[] namesAndValues) {
            var parts = Enumerable.Range(0, namesAndValues.Length / 2)
                .Select(i => Value(namesAndValues[2 * i]) + ":" + Value(namesAndValues[2 * i + 1]));
            return "{" + string.Join(",", parts) + "}";
        }

        private static string Value(object value) {
            if (value is string text) return "\"" + text.Replace("\\", "\\\\").Replace("\"", "\\\"") + "\"";
            if (value is bool flag) return flag ? "true" : "false";
            if (value is double number) return Number(number);
            if (value is IEnumerable<KeyValuePair<string, object>> members) {
                return Json(members.SelectMany(one => new[] { one.Key, one.Value }).ToArray());
            }
            if (value is System.Collections.IEnumerable list) return "[" + string.Join(",", list.Cast<object>().Select(Value)) + "]";
            return Convert.ToString(value, CultureInfo.InvariantCulture);
        }

        private static string Number(double value) {
            if (double.IsNaN(value)) return "NaN";
            if (double.IsInfinity(value)) return value > 0 ? "Infinity" : "-Infinity";
            return value.ToString("R", CultureInfo.InvariantCulture);
        }
    }
}
