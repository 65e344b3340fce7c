using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Text;
using AvatarExport.Core;

namespace AvatarExport.Play
{
    /// <summary>
    /// Asks the Python process at the other end of standard input and output: a line of JSON, then bytes. Every
    /// question is answered by its number of bytes.
    /// </summary>
    internal sealed class Pipe
    {
        private readonly Stream input = Console.OpenStandardInput();
        private readonly Stream output = new BufferedStream(Console.OpenStandardOutput(), 1 << 20);

        /// <summary>Sends a question with words; fills the answer.</summary>
        public void Ask(string json, uint[] sent, uint[] answer)
        {
            Tell(json, sent);
            output.Flush();
            var bytes = new byte[4 * answer.Length];
            int at = 0;
            while (at < bytes.Length)
            {
                int read = input.Read(bytes, at, bytes.Length - at);
                if (read == 0) throw new EndOfStreamException("the other end is gone");
                at += read;
            }
            System.Buffer.BlockCopy(bytes, 0, answer, 0, bytes.Length);
        }

        /// <summary>Sends a statement with words.</summary>
        public void Tell(string json, uint[] sent)
        {
            byte[] line = Encoding.UTF8.GetBytes(json + "\n");
            output.Write(line, 0, line.Length);
            var bytes = new byte[4 * sent.Length];
            System.Buffer.BlockCopy(sent, 0, bytes, 0, bytes.Length);
            output.Write(bytes, 0, bytes.Length);
        }

        public void Close()
        {
            output.Flush();
        }

        /// <summary>A JSON object of names and values that are JSON already.</summary>
        public static string Object(params string[] namesAndValues)
        {
            var parts = new List<string>();
            for (int i = 0; i < namesAndValues.Length; i += 2)
            {
                parts.Add(Text(namesAndValues[i]) + ":" + namesAndValues[i + 1]);
            }
            return "{" + string.Join(",", parts) + "}";
        }

        public static string List(IEnumerable<string> values)
        {
            return "[" + string.Join(",", values) + "]";
        }

        public static string Text(string value)
        {
            return "\"" + value.Replace("\\", "\\\\").Replace("\"", "\\\"") + "\"";
        }

        public static string Number(double value)
        {
            if (double.IsNaN(value)) return "NaN";
            if (double.IsInfinity(value)) return value > 0 ? "Infinity" : "-Infinity";
            return value.ToString("R", CultureInfo.InvariantCulture);
        }
    }
}
