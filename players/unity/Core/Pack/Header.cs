using System;
using System.Collections.Generic;
using System.Text;

namespace AvatarExport.Core {
    /// <summary>Where a tensor lies: bytes Begin .. End of the body.</summary>
    internal struct TensorEntry {
        public long Begin;
        public long End;
    }

    /// <summary>The header of a pack: its document, and its tensors by name.</summary>
    internal sealed class Header {
        private const string Metadata = "pack";
        private const long MostOffset = 1L << 53; // whole numbers of JSON go no further
        private const int LettersShown = 120; // of what is wrong in JSON
        private static readonly Encoding Strict = new UTF8Encoding(false, true);

        public readonly Json Document;
        public readonly Dictionary<string, TensorEntry> Tensors =
            new Dictionary<string, TensorEntry>(NameComparer.Instance);

        /// <summary>Reads `length` bytes of JSON, the header of a safetensors body whose tensors are bytes. Throws AvatarError.</summary>
        public Header(byte[] bytes, int begin, int length) {
            Json header = new Json(Parsed(() => Strict.GetString(bytes, begin, length), "header"), "header");
            string text = null;
            foreach (KeyValuePair<string, Json> said in header.Entries()) {
                if (said.Key == "__metadata__") text = said.Value.Optional(Metadata, pack => pack.Text(), null);
                else Tensors.Add(said.Key, ReadEntry(said.Value));
            }
            if (text == null) {
                throw new AvatarError("is not a pack: it has no document '" + Metadata + "' in its metadata");
            }
            Document = new Json(Parsed(() => text, "document '" + Metadata + "'"), "$");
        }

        private static TensorEntry ReadEntry(Json said) {
            Json[] offsets = said.At("data_offsets").List(2, 2);
            TensorEntry entry = new TensorEntry {
                Begin = offsets[0].Whole(0, MostOffset),
                End = offsets[1].Whole(0, MostOffset),
            };
            long length = said.At("shape").List(1, 1)[0].Whole(0, MostOffset);
            if (said.At("dtype").Text() != "U8" || entry.Begin > entry.End || length != entry.End - entry.Begin) {
                throw new AvatarError("is not the entry of a tensor of bytes", null, said.Path);
            }
            return entry;
        }

        private static object Parsed(Func<string> text, string what) {
            try {
                return JsonText.Parse(text());
            } catch (FormatException error) {
                throw NotJson(what, error.Message);
            } catch (DecoderFallbackException) {
                throw NotJson(what, "it is not UTF-8");
            }
        }

        private static AvatarError NotJson(string what, string why) {
            return new AvatarError("its " + what + " is not JSON (" + Json.Cut(why, LettersShown) + ")");
        }
    }
}
