using System;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>How sections are stored.</summary>
    internal static class Codecs {
        /// <summary>
        /// `count` elements of bytes begin .. end of `bytes`. Throws AvatarError, which names the section `where`, for
        /// another length.
        /// </summary>
        public static Elements Decode(
            byte[] bytes, TensorEntry at, string codec, int bits, long count, int record, string where) {
            if (codec == "pointer") return Pointer(bytes, at, count, where);
            long size = count * (bits / 8);
            if (at.End - at.Begin != size) {
                string line = Invariant($"stores {at.End - at.Begin} bytes; {count} elements of {bits} bits take {size}");
                throw new AvatarError(line, null, where);
            }
            if (codec == "planes" && count % record != 0) {
                string line = Invariant($"has {count} elements, which are no whole records of {record}");
                throw new AvatarError(line, null, where);
            }
            byte[] data = new byte[size];
            if (codec == "raw") Array.Copy(bytes, at.Begin, data, 0, size);
            else Gather(bytes, (int)at.Begin, data, (codec == "planes" ? record : 1) * (bits / 8));
            if (codec == "delta") Sum(data, bits / 8);
            return new Elements(data, bits);
        }

        /// <summary>Puts planes together: byte c of record r is from[begin + c * records + r].</summary>
        private static void Gather(byte[] from, int begin, byte[] into, int size) {
            int records = into.Length / size;
            for (int c = 0; c < size; c++) {
                int at = begin + c * records;
                for (int to = c; to < into.Length; to += size) into[to] = from[at++];
            }
        }

        /// <summary>Adds to each element the one before it, modulo 2^bits.</summary>
        private static void Sum(byte[] data, int width) {
            uint sum = 0;
            for (int at = 0; at < data.Length; at += width) {
                unchecked {
                    for (int b = 0; b < width; b++) sum += (uint)data[at + b] << (8 * b);
                }
                for (int b = 0; b < width; b++) data[at + b] = (byte)(sum >> (8 * b));
            }
        }

        private static Elements Pointer(byte[] bytes, TensorEntry at, long count, string where) {
            long rows = count - 1;
            long length = at.End - at.Begin;
            long size = rows > 0 ? length / rows : 1;
            if (rows < 0 || (size != 1 && size != 2 && size != 4) || size * rows != length) {
                throw new AvatarError(Invariant($"stores {length} bytes for {rows} counts"), null, where);
            }
            byte[] ends = new byte[4 * count];
            long end = 0;
            for (long row = 0; row < rows; row++) {
                for (int b = 0; b < size; b++) end += (long)bytes[at.Begin + b * rows + row] << (8 * b);
                for (int b = 0; b < 4; b++) ends[4 * (row + 1) + b] = (byte)(end >> (8 * b));
            }
            if (end > uint.MaxValue) throw new AvatarError("counts more than 2^32 entries", null, where);
            return new Elements(ends, 32);
        }

        /// <summary>Elements of 32 bits.</summary>
        public static Elements OfWords(uint[] words) {
            byte[] data = new byte[4 * words.LongLength];
            Buffer.BlockCopy(words, 0, data, 0, data.Length);
            return new Elements(data, 32);
        }

        /// <summary>Numbers as elements of so many bits, each modulo 2^bits.</summary>
        public static Elements Narrowed(uint[] numbers, int bits) {
            if (bits == 32) return OfWords(numbers);
            byte[] data = new byte[numbers.Length * (bits / 8)];
            for (int i = 0, at = 0; i < numbers.Length; i++) {
                for (int shift = 0; shift < bits; shift += 8) data[at++] = (byte)(numbers[i] >> shift);
            }
            return new Elements(data, bits);
        }
    }

    /// <summary>
    /// Triangles around each vertex: those of vertex v, rising, are Triangle[Ptr[v]] .. Triangle[Ptr[v + 1] - 1].
    /// </summary>
    internal sealed class Incidence {
        public readonly uint[] Ptr; // [V + 1]
        public readonly uint[] Triangle; // [3 F]

        /// <summary>Around each vertex of `corners` [3, F]. Throws AvatarError for a corner that is no vertex.</summary>
        public Incidence(Elements corners, int vertices, string where) {
            int triangles = corners.Length / 3;
            Ptr = new uint[Math.Max(vertices, 0) + 1];
            for (int i = 0; i < corners.Length; i++) {
                uint vertex = corners[i];
                if (vertex >= vertices || corners.Length % 3 != 0) {
                    string line = Invariant($"has corners that are none of the {vertices} vertices");
                    throw new AvatarError(line, null, where);
                }
                Ptr[vertex + 1]++;
            }
            for (int v = 0; v < vertices; v++) Ptr[v + 1] += Ptr[v];
            Triangle = new uint[corners.Length];
            for (int t = 0; t < triangles; t++) {
                for (int corner = 0; corner < 3; corner++) {
                    Triangle[Ptr[corners[corner * triangles + t]]++] = (uint)t;
                }
            }
            for (int v = vertices; v > 0; v--) Ptr[v] = Ptr[v - 1]; // each has gone on to the next
            Ptr[0] = 0;
        }
    }
}
