using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>A record of a CSV file.</summary>
    internal sealed class CsvRow {
        /// <summary>The line on which it begins, from 1.</summary>
        public int Line;

        /// <summary>Its fields; none of an empty line.</summary>
        public readonly List<string> Fields = new List<string>();
    }

    /// <summary>Reads CSV texts, with quotes as RFC 4180 has them.</summary>
    internal sealed class Csv {
        private readonly string text;
        private int at;
        private int line = 1;

        private Csv(string text) {
            this.text = text;
            at = text.Length > 0 && text[0] == '\uFEFF' ? 1 : 0;
        }

        /// <summary>The records of a text. Throws AvatarError that names the line.</summary>
        public static IEnumerable<CsvRow> Rows(string text) {
            var reader = new Csv(text);
            while (reader.at < text.Length) yield return reader.Next();
        }

        private CsvRow Next() {
            var row = new CsvRow { Line = line };
            for (;;) {
                row.Fields.Add(Letter(at) == '"' ? Quoted() : Plain());
                if (Letter(at) != ',') break;
                at++;
            }
            if (Letter(at) == '\r') at++;
            if (Letter(at) == '\n') at++;
            line++;
            if (row.Fields.Count == 1 && row.Fields[0].Length == 0) row.Fields.Clear();
            return row;
        }

        private int Letter(int index) => index < text.Length ? text[index] : -1;

        private string Plain() {
            int begin = at;
            while (at < text.Length && text[at] != ',' && text[at] != '\n' && text[at] != '\r') at++;
            return text.Substring(begin, at - begin);
        }

        private string Quoted() {
            int begin = at + 1, first = line;
            at = begin;
            for (;;) {
                while (at < text.Length && text[at] != '"') {
                    if (text[at] == '\n') line++;
                    at++;
                }
                if (at == text.Length) throw new AvatarError($"line {first}: a quotation mark is not closed");
                if (Letter(at + 1) != '"') break;
                at += 2;
            }
            string value = text.Substring(begin, at - begin).Replace("\"\"", "\"");
            at++;
            if (at < text.Length && ",\r\n".IndexOf(text[at]) < 0) {
                throw new AvatarError($"line {first}: a comma is missing behind a quotation mark");
            }
            return value;
        }
    }
}
