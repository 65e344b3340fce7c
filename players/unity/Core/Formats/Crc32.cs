namespace AvatarExport.Core {
    /// <summary>The checksum of gzip.</summary>
    internal static class Crc32 {
        private const uint Polynomial = 0xedb88320;
        private static readonly uint[] Table = MakeTable();

        /// <summary>Of bytes begin .. end, which follow those of the checksum `before`.</summary>
        public static uint Of(byte[] bytes, int begin, int end, uint before = 0) {
            uint state = ~before;
            for (int at = begin; at < end; at++) state = (state >> 8) ^ Table[(state ^ bytes[at]) & 0xff];
            return ~state;
        }

        private static uint[] MakeTable() {
            uint[] table = new uint[256];
            for (uint i = 0; i < table.Length; i++) {
                uint value = i;
                for (int bit = 0; bit < 8; bit++) value = (value & 1) != 0 ? (value >> 1) ^ Polynomial : value >> 1;
                table[i] = value;
            }
            return table;
        }
    }
}
