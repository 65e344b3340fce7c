using System;
using System.Linq;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>A pack, inflated: its header, and the bytes of its tensors.</summary>
    internal sealed class Inflated {
        private const int HeaderLimit = 16 << 20; // bytes of JSON; of a small file
        private const int HeaderBase = 1 << 16, HeaderRatio = 16; // at most HeaderBase and HeaderRatio bytes a byte of it
        private const int BodyLimit = 1 << 30; // bytes, inflated
        public const int MostRatio = 400; // inflated bytes a byte of the file; gzip reaches 1032 on zeros alone
        private const int LengthBytes = 8; // before the header

        public readonly Header Header;

        /// <summary>Entries of the header count from byte Body of it.</summary>
        public readonly byte[] Bytes;

        public readonly int Body;

        private readonly Gzip gzip;

        /// <summary>Inflates a pack, never more than its header says and the limits allow. Throws AvatarError.</summary>
        public Inflated(byte[] file) {
            CheckBegin(file);
            try {
                gzip = new Gzip(file);
                Inflate(LengthBytes);
                Body = LengthBytes + HeaderLength(gzip.Bytes, file.Length);
                Inflate(Body);
                Header = new Header(gzip.Bytes, LengthBytes, Body - LengthBytes);
                long total = Header.Tensors.Values.Select(entry => entry.End).DefaultIfEmpty(0).Max();
                if (total > MostOf(file.Length)) {
                    string limits = Invariant($"at most {MostRatio} times its size and {BodyLimit} are inflated");
                    throw new AvatarError(Invariant($"claims {total} bytes in a file of {file.Length}; ") + limits);
                }
                Inflate(Body + (int)total);
                if (gzip.Length > Body + total || gzip.Inflate(gzip.Length + 1)) {
                    throw new AvatarError("goes on after its last tensor");
                }
                gzip.CheckEnd();
            } catch (FormatException error) {
                throw new AvatarError("is damaged or cut off (" + error.Message + "); load it again");
            }
            Bytes = gzip.Bytes;
        }

        /// <summary>The most bytes that may be made of a file of `bytes` bytes.</summary>
        public static long MostOf(long bytes) => Math.Min(BodyLimit, MostRatio * bytes);

        /// <summary>Throws AvatarError unless a file begins as gzip does.</summary>
        private static void CheckBegin(byte[] file) {
            if (file.Length >= 2 && file[0] == 0x1f && file[1] == 0x8b) return;
            if (file.Length > LengthBytes && file[LengthBytes] == (byte)'{' && file[LengthBytes - 1] == 0) {
                throw new AvatarError(
                    "was inflated on its way: the server must send packs as they are, without Content-Encoding");
            }
            throw new AvatarError("is not a pack: it does not begin as a gzip file");
        }

        private static int HeaderLength(byte[] begin, long bytes) {
            ulong length = BitConverter.ToUInt64(begin, 0);
            long most = Math.Min(HeaderLimit, HeaderBase + HeaderRatio * bytes);
            if (length > (ulong)most) {
                throw new AvatarError(Invariant($"claims a header of {length} bytes; up to {most} are read"));
            }
            return (int)length;
        }

        private void Inflate(int length) {
            if (!gzip.Inflate(length)) {
                string line = Invariant($"ends {length - gzip.Length} bytes too early: it was cut off; load it again");
                throw new AvatarError(line);
            }
        }
    }
}
