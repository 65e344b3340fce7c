using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>A member of a uniform block.</summary>
    public struct Member {
        /// <summary>As constants of passes name it.</summary>
        public readonly string Name;

        /// <summary>As HLSL spells it: "uint", "float4".</summary>
        public readonly string Type;

        /// <summary>"NAME" of a uint, or "NAME:TYPE".</summary>
        internal Member(string told) {
            string[] parts = told.Split(':');
            Name = parts[0];
            Type = parts.Length == 1 ? "uint" : parts[1];
        }
    }

    /// <summary>A storage buffer of an entry.</summary>
    public struct StorageBuffer {
        /// <summary>The shader's name of it.</summary>
        public readonly string Name;

        /// <summary>Bytes of an element.</summary>
        public readonly int Stride;

        /// <summary>Whether the entry only reads it.</summary>
        public readonly bool IsReadOnly;

        internal StorageBuffer(string name, int stride, bool isReadOnly) {
            Name = name;
            Stride = stride;
            IsReadOnly = isReadOnly;
        }
    }

    /// <summary>What a compute entry of the shaders binds.</summary>
    public sealed class Interface {
        /// <summary>Of the frame: "morph", "blend", "sort".</summary>
        public readonly string Stage;

        /// <summary>In the order of their bindings.</summary>
        public readonly StorageBuffer[] Storage;

        /// <summary>Of its one uniform block, in their order.</summary>
        public readonly Member[] Members;

        /// <summary>What a pass of it reads and writes; null for an entry that no program may use.</summary>
        internal readonly Contract Access;

        internal Interface(string stage, StorageBuffer[] storage, string members, Contract access) {
            Stage = stage;
            Storage = storage;
            Members = Array.ConvertAll(members.Split(' '), one => new Member(one));
            Access = access;
        }
    }

    /// <summary>
    /// What a pass of an entry reads and writes, by its constants: avatar_shaders/contracts.py explains each key.
    /// Expressions are sums of products: "3*#morph_ptr+1".
    /// </summary>
    internal sealed class Contract {
        public string Rows;
        public readonly Dictionary<string, long> Most = new Dictionary<string, long>();
        public readonly Dictionary<string, int[]> Values = new Dictionary<string, int[]>();
        public string[][] Fits = new string[0][];
        public readonly Dictionary<string, string> Pose = new Dictionary<string, string>();
        public readonly Dictionary<string, string[]> Same = new Dictionary<string, string[]>();
        public string Chunk;
        public string[] Level = new string[0];
        public readonly Dictionary<string, Touched[]> Elements = new Dictionary<string, Touched[]>();
        public readonly Dictionary<string, SectionContract> Sections = new Dictionary<string, SectionContract>();
    }

    /// <summary>What holds only for these values of constants; without any, always.</summary>
    internal abstract class Conditional {
        public readonly Dictionary<string, int[]> When = new Dictionary<string, int[]>();
    }

    /// <summary>How many elements of a buffer without sections a pass touches.</summary>
    internal sealed class Touched : Conditional {
        public string Elements;
    }

    /// <summary>A section of a packed buffer.</summary>
    internal sealed class SectionContract : Conditional {
        public string Buffer;
        public string Kind; // "pointer", "index", "linear", "signed", "weight", "table"
        public string Elements;
        public string Width; // null: 32 bits
        public int[] Widths = { 32 };
        public string Below;
        public long Pointer;
        public string Scale;
        public string Floats;
    }
}
