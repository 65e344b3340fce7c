using System;

namespace AvatarExport.Core {
    /// <summary>Reads a file bit by bit, the lowest bit of a byte first.</summary>
    internal sealed class BitReader {
        private readonly byte[] file;
        private int next; // byte
        private ulong held;
        private int count; // of held bits

        public BitReader(byte[] file, int begin) {
            this.file = file;
            next = begin;
        }

        /// <summary>The next bits, at least 15 unless the file ends; those after its end are 0.</summary>
        public uint Peek() {
            while (count <= 48 && next < file.Length) {
                held |= (ulong)file[next++] << count;
                count += 8;
            }
            return (uint)held;
        }

        /// <summary>Goes on by some bits. Throws FormatException at the end of the file.</summary>
        public void Skip(int bits) {
            if (bits > count) throw new FormatException("it was cut off");
            held >>= bits;
            count -= bits;
        }

        /// <summary>The next bits, at most 16.</summary>
        public int Take(int bits) {
            int taken = (int)(Peek() & ((1u << bits) - 1));
            Skip(bits);
            return taken;
        }

        /// <summary>Goes on to the beginning of a byte.</summary>
        public void ToByte() => Skip(count & 7);

        /// <summary>The next byte of the file, after ToByte.</summary>
        public int Position() {
            ToByte();
            next -= count / 8;
            held = 0;
            count = 0;
            return next;
        }

        public void Copy(byte[] into, int at, int bytes) {
            int from = Position();
            if (bytes > file.Length - from) throw new FormatException("it was cut off");
            Buffer.BlockCopy(file, from, into, at, bytes);
            next = from + bytes;
        }
    }

    /// <summary>A Huffman code of deflate. Short codes are looked up, longer ones are counted through.</summary>
    internal sealed class Huffman {
        private const int MostBits = 15;
        private const int ShortBits = 9;
        private readonly ushort[] shortCodes = new ushort[1 << ShortBits]; // symbol * 16 + length; 0: a longer code
        private readonly int[] counts = new int[MostBits + 1]; // of codes by length
        private readonly ushort[] symbols; // by code

        /// <summary>
        /// The code of the first `count` lengths. Throws FormatException for one that is ambiguous or has gaps; a code of
        /// one symbol may have one where `mayBeAlone`.
        /// </summary>
        public Huffman(byte[] lengths, int count, bool mayBeAlone = false) {
            for (int i = 0; i < count; i++) counts[lengths[i]]++;
            int used = count - counts[0];
            counts[0] = 0;
            int left = 1;
            for (int length = 1; length <= MostBits; length++) {
                left = 2 * left - counts[length];
                if (left < 0) throw new FormatException("a code is ambiguous");
            }
            if (left > 0 && !(mayBeAlone && used <= 1 && counts[1] == used)) throw new FormatException("a code has gaps");
            symbols = new ushort[used];
            Assign(lengths, count);
        }

        private void Assign(byte[] lengths, int count) {
            int[] places = new int[MostBits + 2]; // in symbols, by length
            int[] codes = new int[MostBits + 2];
            for (int length = 1; length <= MostBits; length++) {
                places[length + 1] = places[length] + counts[length];
                codes[length + 1] = (codes[length] + counts[length]) << 1;
            }
            for (int symbol = 0; symbol < count; symbol++) {
                int length = lengths[symbol];
                if (length == 0) continue;
                symbols[places[length]++] = (ushort)symbol;
                int code = codes[length]++;
                if (length > ShortBits) continue;
                int reversed = 0;
                for (int bit = 0; bit < length; bit++) reversed |= ((code >> bit) & 1) << (length - 1 - bit);
                for (int at = reversed; at < shortCodes.Length; at += 1 << length) {
                    shortCodes[at] = (ushort)(symbol << 4 | length);
                }
            }
        }

        /// <summary>The next symbol. Throws FormatException at the file's end and for a code that means nothing.</summary>
        public int Read(BitReader bits) {
            uint held = bits.Peek();
            int found = shortCodes[held & (shortCodes.Length - 1)];
            if (found != 0) {
                bits.Skip(found & 15);
                return found >> 4;
            }
            int code = 0, first = 0, place = 0;
            for (int length = 1; length <= MostBits; length++) {
                code |= (int)(held >> (length - 1)) & 1;
                if (code - first < counts[length]) {
                    bits.Skip(length);
                    return symbols[place + code - first];
                }
                place += counts[length];
                first = (first + counts[length]) << 1;
                code <<= 1;
            }
            throw new FormatException("a code that means nothing");
        }
    }
}
