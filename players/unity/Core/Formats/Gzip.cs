using System;

namespace AvatarExport.Core {
    /// <summary>
    /// Inflates one gzip file piece by piece and checks all of it. The hosts' own streams differ in what they check: some
    /// accept bytes after the end, others a wrong checksum.
    /// </summary>
    internal sealed class Gzip {
        private const int HeadBytes = 10;
        private const int TailBytes = 8; // checksum and length
        private const int Deflate = 8;
        private const int MostMatch = 258;
        private const int Window = 1 << 15;
        private const int FirstPiece = 1 << 16; // bytes of memory that are taken ahead of the data
        private const int EndOfBlock = 256;
        private static readonly Huffman FixedLiterals = new Huffman(FixedLengths(), 288);
        private static readonly Huffman FixedDistances = new Huffman(Repeated(5, 32), 32);
        private static readonly int[] Order = { 16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15 };
        private static readonly int[] LengthBase = Bases(3, 28, 4);
        private static readonly int[] DistanceBase = Bases(1, 30, 2);

        private readonly BitReader bits;
        private readonly byte[] file;
        private Huffman literals; // null: no block is open, or a stored one
        private Huffman distances;
        private int stored; // bytes left of a stored block
        private bool isLast;

        /// <summary>Throws FormatException for what is no gzip file.</summary>
        public Gzip(byte[] file) {
            this.file = file;
            bits = new BitReader(file, BodyOf(file));
        }

        /// <summary>What was inflated so far, and room for more.</summary>
        public byte[] Bytes { get; private set; } = new byte[FirstPiece];

        /// <summary>How many bytes were inflated so far.</summary>
        public int Length { get; private set; }

        /// <summary>
        /// Inflates until there are at least `length` bytes, or the end is reached. It may be a few more. Throws
        /// FormatException for a file that is damaged or cut off. Memory grows with what there is, not with what is asked.
        /// </summary>
        public bool Inflate(int length) {
            while (Length < length) {
                if (literals == null && stored == 0) {
                    if (isLast) return false;
                    OpenBlock();
                } else if (literals == null) {
                    int count = Math.Min(stored, Math.Min(length - Length, FirstPiece));
                    Reserve(count);
                    bits.Copy(Bytes, Length, count);
                    Length += count;
                    stored -= count;
                } else {
                    InflateSymbols(length);
                }
            }
            return true;
        }

        /// <summary>After all has been inflated: checks that nothing follows, the checksum and the length.</summary>
        public void CheckEnd() {
            if (Inflate(Length + 1)) throw new FormatException("it is longer than it says");
            int tail = bits.Position();
            if (file.Length - tail < TailBytes) throw new FormatException("it was cut off");
            if (file.Length - tail > TailBytes) throw new FormatException("other bytes follow");
            bool isSame = BitConverter.ToUInt32(file, tail) == Crc32.Of(Bytes, 0, Length)
                && BitConverter.ToUInt32(file, tail + 4) == (uint)Length;
            if (!isSame) throw new FormatException("its checksum differs");
        }

        /// <summary>Where the data begins, after the header.</summary>
        private static int BodyOf(byte[] file) {
            const int hasChecksum = 2, hasExtra = 4, hasName = 8, hasComment = 16, reserved = 0xe0;
            if (file.Length < HeadBytes) throw new FormatException("it was cut off");
            int flags = file[3];
            if (file[2] != Deflate || (flags & reserved) != 0) throw new FormatException("an unknown kind of gzip");
            long at = HeadBytes;
            if ((flags & hasExtra) != 0) {
                if (file.Length < at + 2) throw new FormatException("it was cut off");
                at += 2 + BitConverter.ToUInt16(file, (int)at);
            }
            foreach (int text in new[] { hasName, hasComment }) {
                if ((flags & text) == 0) continue;
                while (at < file.Length && file[at] != 0) at++;
                at++;
            }
            if ((flags & hasChecksum) != 0) at += 2;
            if (at > file.Length) throw new FormatException("it was cut off");
            if ((flags & hasChecksum) != 0) {
                bool isSame = BitConverter.ToUInt16(file, (int)at - 2) == (ushort)Crc32.Of(file, 0, (int)at - 2);
                if (!isSame) throw new FormatException("the checksum of its header differs");
            }
            return (int)at;
        }

        private void OpenBlock() {
            isLast = bits.Take(1) == 1;
            switch (bits.Take(2)) {
                case 0:
                    bits.ToByte();
                    stored = bits.Take(16);
                    if (bits.Take(16) != (~stored & 0xffff)) throw new FormatException("a stored block is damaged");
                    break;
                case 1:
                    literals = FixedLiterals;
                    distances = FixedDistances;
                    break;
                case 2:
                    ReadCodes();
                    break;
                default:
                    throw new FormatException("an unknown kind of block");
            }
        }

        private void ReadCodes() {
            int literalCount = bits.Take(5) + 257;
            int distanceCount = bits.Take(5) + 1;
            int lengthCount = bits.Take(4) + 4;
            if (literalCount > 286 || distanceCount > 30) throw new FormatException("too many codes");
            byte[] lengths = new byte[Order.Length];
            for (int i = 0; i < lengthCount; i++) lengths[Order[i]] = (byte)bits.Take(3);
            Huffman ofLengths = new Huffman(lengths, lengths.Length);
            byte[] all = new byte[literalCount + distanceCount];
            for (int i = 0; i < all.Length;) {
                int symbol = ofLengths.Read(bits);
                int times = Times(symbol);
                if (i + times > all.Length || (symbol == 16 && i == 0)) throw new FormatException("damaged codes");
                byte length = symbol < 16 ? (byte)symbol : symbol == 16 ? all[i - 1] : (byte)0;
                for (int end = i + times; i < end; i++) all[i] = length;
            }
            if (all[EndOfBlock] == 0) throw new FormatException("a block has no end");
            byte[] ofDistances = new byte[distanceCount];
            Array.Copy(all, literalCount, ofDistances, 0, distanceCount);
            literals = new Huffman(all, literalCount, true);
            distances = new Huffman(ofDistances, distanceCount, true);
        }

        /// <summary>How often a length stands that a symbol of the lengths says.</summary>
        private int Times(int symbol) {
            if (symbol < 16) return 1;
            if (symbol == 16) return 3 + bits.Take(2);
            return symbol == 17 ? 3 + bits.Take(3) : 11 + bits.Take(7);
        }

        private void InflateSymbols(int length) {
            while (Length < length) {
                int symbol = literals.Read(bits);
                Reserve(MostMatch);
                if (symbol < EndOfBlock) {
                    Bytes[Length++] = (byte)symbol;
                } else if (symbol == EndOfBlock) {
                    literals = null;
                    return;
                } else {
                    Repeat(symbol - EndOfBlock - 1);
                }
            }
        }

        private void Repeat(int code) {
            if (code > 28) throw new FormatException("an unknown length");
            int length = code == 28 ? MostMatch : LengthBase[code] + bits.Take(code < 8 ? 0 : (code - 4) / 4);
            code = distances.Read(bits);
            if (code > 29) throw new FormatException("an unknown distance");
            int distance = DistanceBase[code] + bits.Take(code < 4 ? 0 : (code - 2) / 2);
            if (distance > Length || distance > Window) throw new FormatException("a distance leads before the beginning");
            byte[] bytes = Bytes;
            for (int from = Length - distance, end = Length + length; Length < end; Length++) bytes[Length] = bytes[from++];
        }

        private void Reserve(int more) {
            if (Bytes.Length - Length >= more) return;
            byte[] larger = new byte[(int)Math.Min(Math.Max(2L * Bytes.Length, (long)Length + more), int.MaxValue - 63)];
            Buffer.BlockCopy(Bytes, 0, larger, 0, Length);
            Bytes = larger;
        }

        private static byte[] FixedLengths() {
            byte[] lengths = new byte[288];
            for (int i = 0; i < lengths.Length; i++) lengths[i] = (byte)(i < 144 ? 8 : i < 256 ? 9 : i < 280 ? 7 : 8);
            return lengths;
        }

        private static byte[] Repeated(byte value, int count) {
            byte[] made = new byte[count];
            for (int i = 0; i < count; i++) made[i] = value;
            return made;
        }

        /// <summary>The first value of each code: a bit more for every `step` codes after the first 2 * `step`.</summary>
        private static int[] Bases(int first, int count, int step) {
            int[] bases = new int[count];
            for (int code = 0, value = first; code < count; code++) {
                bases[code] = value;
                value += 1 << (code < 2 * step ? 0 : (code - step) / step);
            }
            return bases;
        }
    }
}
