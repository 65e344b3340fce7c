using System;
using System.Collections.Generic;
using System.Linq;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>An array that no buffer holds.</summary>
    internal sealed class HeldArray {
        public string Type; // "f32", "u8", "u16", "u32", "i32"
        public long[] Shape;
        public Elements Elements;

        /// <summary>Whether it has this type and shape; -1 is any length.</summary>
        public bool Is(string type, params long[] shape) {
            if (Type != type || Shape.Length != shape.Length) return false;
            return !shape.Where((length, i) => length != -1 && length != Shape[i]).Any();
        }
    }

    /// <summary>Sections and arrays from the tensors of a document. Throws AvatarError for what does not fit.</summary>
    internal sealed class Tensors {
        private const int MostName = 96; // letters in a message
        private const int MostVertices = 1 << 24; // of a mesh whose incidence is made
        private const long MostDecoded = 1L << 31; // bytes of all sections and arrays

        private readonly Inflated inflated;
        private readonly Dictionary<string, Elements> decoded = // equal contents are stored once, and decoded once
            new Dictionary<string, Elements>(NameComparer.Instance);
        private readonly long most;
        private long left;

        /// <summary>Of a file of so many bytes.</summary>
        public Tensors(Inflated inflated, long file) {
            this.inflated = inflated;
            left = most = Math.Min(MostDecoded, Inflated.MostRatio * file);
        }

        /// <summary>The buffers of a program, by name.</summary>
        public Dictionary<string, ProgramBuffer> Buffers(Json listed) {
            Dictionary<string, ProgramBuffer> found = new Dictionary<string, ProgramBuffer>(NameComparer.Instance);
            foreach (Json said in listed.List()) {
                string name = said.At("name").Text();
                if (found.ContainsKey(name)) throw new AvatarError("is named twice", null, "buffer " + name);
                found.Add(name, ReadBuffer(name, said));
            }
            return found;
        }

        private ProgramBuffer ReadBuffer(string name, Json said) {
            long bytes = said.Optional("bytes", one => one.Whole(0, int.MaxValue), -1);
            Json listed = said.At("sections");
            if (bytes >= 0 != listed.IsMissing) {
                throw new AvatarError("needs either bytes or sections", null, "buffer " + name);
            }
            Take(Math.Max(bytes, 0), "buffer " + name);
            if (bytes >= 0) return new ProgramBuffer(name, bytes, new Section[0]);
            Section[] sections = Sections(name, listed.List());
            return new ProgramBuffer(name, ProgramBuffer.BytesOf(sections), sections);
        }

        private Section[] Sections(string buffer, Json[] listed) {
            List<Section> found = new List<Section>();
            Incidence around = null;
            foreach (Json said in listed) {
                string name = said.At("name").Text();
                string where = "buffer " + buffer + ", section " + name;
                if (found.Any(one => one.Name == name)) throw new AvatarError("is named twice", null, where);
                int bits = said.At("bits").Int();
                long count = said.At("count").Whole();
                string codec = said.At("codec").Text();
                Elements elements;
                if (codec == "incidence") {
                    around = around ?? AroundVertices(listed, found, where);
                    Take(count * (bits / 8), where);
                    elements = Codecs.Narrowed(name == "vertex_triangle_ptr" ? around.Ptr : around.Triangle, bits);
                    CheckCount(elements, count, where);
                } else {
                    Take(count * (codec == "pointer" ? 4 : bits / 8), where);
                    int record = said.Optional("record", one => one.Int(), 1);
                    elements = Decode(said.At("tensor"), codec, bits, count, record, where);
                }
                found.Add(new Section(name, elements));
            }
            return found.ToArray();
        }

        private static void CheckCount(Elements elements, long count, string where) {
            if (elements.Length != count) {
                throw new AvatarError(Invariant($"has {elements.Length} elements, not {count}"), null, where);
            }
        }

        private Elements Decode(Json tensor, string codec, int bits, long count, int record, string where) {
            string name = tensor.Text();
            string key = Invariant($"{codec} {bits} {count} {record} {name}");
            Elements elements;
            if (decoded.TryGetValue(key, out elements)) return elements;
            TensorEntry entry;
            if (!inflated.Header.Tensors.TryGetValue(name, out entry)) {
                throw new AvatarError("tensor '" + Json.Cut(name, MostName) + "' is missing", null, where);
            }
            entry.Begin += inflated.Body;
            entry.End += inflated.Body;
            elements = Codecs.Decode(inflated.Bytes, entry, codec, bits, count, record, where);
            decoded.Add(key, elements);
            CheckCount(elements, count, where);
            return elements;
        }

        /// <summary>Also of a tensor that was decoded before.</summary>
        private void Take(double bytes, string where) {
            if (bytes > left) throw new AvatarError(Invariant($"with it the pack takes more than {most} bytes"), null, where);
            left -= (long)bytes;
        }

        /// <summary>The arrays of a document, by name.</summary>
        public Dictionary<string, HeldArray> Arrays(Json listed) {
            Dictionary<string, HeldArray> found = new Dictionary<string, HeldArray>(NameComparer.Instance);
            foreach (KeyValuePair<string, Json> one in listed.Entries()) {
                string type = one.Value.At("type").Text();
                long[] shape = one.Value.At("shape").List().Select(length => length.Whole()).ToArray();
                double count = shape.Aggregate(1.0, (product, length) => product * length);
                string codec = one.Value.At("codec").Text();
                int bits = type == "u8" ? 8 : type == "u16" ? 16 : 32;
                string where = "array " + one.Key;
                Take(count * (bits / 8), where);
                Elements elements = Decode(one.Value.At("tensor"), codec, bits, (long)count, 1, where);
                found.Add(one.Key, new HeldArray { Type = type, Shape = shape, Elements = elements });
            }
            return found;
        }

        private Incidence AroundVertices(Json[] listed, List<Section> found, string where) {
            Section corners = found.FirstOrDefault(one => one.Name == "corners");
            Json pointer = listed.FirstOrDefault(one => one.At("name").Value as string == "vertex_triangle_ptr");
            long count = pointer == null ? 0 : pointer.At("count").Whole();
            if (corners == null || count < 1) {
                throw new AvatarError("codec incidence needs section corners before it", null, where);
            }
            if (count > MostVertices + 1 || 4 * count > left) Take(double.PositiveInfinity, where);
            return new Incidence(corners.Elements, (int)count - 1, where);
        }
    }
}
