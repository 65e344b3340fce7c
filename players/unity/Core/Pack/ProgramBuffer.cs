using System;
using System.Collections.Generic;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>The elements of a section: whole numbers, or the bits of float32. Nothing of it changes.</summary>
    public sealed class Elements {
        /// <summary>Little-endian, one element after the other.</summary>
        internal readonly byte[] Data;

        /// <summary>Of an element: 8, 16 or 32.</summary>
        public readonly int Bits;

        /// <summary>How many there are.</summary>
        public readonly int Length;

        internal Elements(byte[] data, int bits) {
            Data = data;
            Bits = bits;
            Length = data.Length / (bits / 8);
        }

        /// <summary>32-bit words that they take.</summary>
        public int Words => (int)((Data.LongLength + ProgramBuffer.Word - 1) / ProgramBuffer.Word);

        /// <summary>Element i.</summary>
        public uint this[int i] {
            get {
                if (Bits == 8) return Data[i];
                return Bits == 16 ? BitConverter.ToUInt16(Data, 2 * i) : BitConverter.ToUInt32(Data, 4 * i);
            }
        }

        /// <summary>Element i of 32 bits as float32.</summary>
        public float FloatAt(int i) => BitConverter.ToSingle(Data, 4 * i);

        /// <summary>Elements of 32 bits as an array of float, int or uint.</summary>
        internal T[] Copied<T>() where T : struct {
            T[] made = new T[Length];
            Buffer.BlockCopy(Data, 0, made, 0, Data.Length);
            return made;
        }
    }

    /// <summary>A run of equal elements in a packed buffer. It begins at a 32-bit word.</summary>
    public sealed class Section {
        /// <summary>The constant that tells kernels where it begins.</summary>
        public readonly string Name;

        /// <summary>What it holds.</summary>
        public readonly Elements Elements;

        /// <summary>Elements with a name.</summary>
        public Section(string name, Elements elements) {
            Name = name;
            Elements = elements;
        }
    }

    /// <summary>A buffer of the GPU: static with sections, or writable with a size alone.</summary>
    public sealed class ProgramBuffer {
        internal const int Word = 4; // bytes
        private const long MostBytes = int.MaxValue; // sizes in OpenGL's interface are signed

        /// <summary>As passes call it.</summary>
        public readonly string Name;

        /// <summary>Its size.</summary>
        public readonly int Bytes;

        /// <summary>None if it is writable.</summary>
        public readonly Section[] Sections;

        /// <summary>A buffer of that size. Throws AvatarError for a size that no GPU has.</summary>
        public ProgramBuffer(string name, long bytes, Section[] sections) {
            if (bytes < 0 || bytes > MostBytes) {
                throw new AvatarError(Invariant($"has {bytes} bytes; {MostBytes} are the most"), null, Place(name));
            }
            Name = name;
            Bytes = (int)bytes;
            Sections = sections;
        }

        /// <summary>The field of an error about a buffer, or a section of it.</summary>
        internal static string Place(string name, string section = null) {
            string place = "buffer " + Json.Cut(name, 80);
            return section == null ? place : place + ", " + Json.Cut(section, 80);
        }

        /// <summary>Bytes that sections take.</summary>
        internal static long BytesOf(Section[] sections) {
            long words = 0;
            foreach (Section section in sections) words += section.Elements.Words;
            return Word * words;
        }

        /// <summary>Section name -> its first word.</summary>
        public Dictionary<string, int> Offsets() {
            Dictionary<string, int> found = new Dictionary<string, int>();
            int at = 0;
            foreach (Section section in Sections) {
                found[section.Name] = at;
                at += section.Elements.Words;
            }
            return found;
        }

        /// <summary>
        /// The words [Bytes / 4] that are uploaded for a buffer with sections. Each begins at a word; the rest of its
        /// last word is 0.
        /// </summary>
        public uint[] Content() {
            uint[] content = new uint[BytesOf(Sections) / Word];
            int at = 0;
            foreach (Section section in Sections) {
                byte[] data = section.Elements.Data;
                Buffer.BlockCopy(data, 0, content, at, data.Length);
                at += Word * section.Elements.Words;
            }
            return content;
        }

        /// <summary>The section of that name; or null.</summary>
        public Section Find(string name) {
            foreach (Section section in Sections) {
                if (section.Name == name) return section;
            }
            return null;
        }
    }
}
