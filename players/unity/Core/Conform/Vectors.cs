using System;
using System.Collections.Generic;
using System.Text;

namespace AvatarExport.Core {
    /// <summary>
    /// Reads the tensors of a .safetensors file as float64, which holds all numbers of a reference exactly.
    /// </summary>
    internal static class Vectors {
        private const string Owner = "the vectors of the reference";
        private const int LengthBytes = 8;

        /// <summary>
        /// Tensors by name. Throws AvatarError for a file that is cut off or not a .safetensors file.
        /// </summary>
        public static Dictionary<string, double[]> Read(byte[] file) {
            try {
                return Tensors(file);
            } catch (AvatarError error) {
                throw error.Of(Owner);
            } catch (FormatException error) {
                throw new AvatarError("the header is not JSON: " + error.Message, Owner);
            }
        }

        private static Dictionary<string, double[]> Tensors(byte[] file) {
            ulong length = file.Length < LengthBytes ? ulong.MaxValue : BitConverter.ToUInt64(file, 0);
            if (length > (ulong)Math.Max(file.Length - LengthBytes, 0)) {
                throw new AvatarError("ends before its header does");
            }
            int begin = LengthBytes + (int)length;
            var header = new Json(JsonText.Parse(Encoding.UTF8.GetString(file, LengthBytes, (int)length)), "header");
            var found = new Dictionary<string, double[]>();
            foreach (KeyValuePair<string, Json> one in header.Entries()) {
                if (one.Key == "__metadata__") continue;
                Json[] offsets = one.Value.At("data_offsets").List(2, 2);
                int first = offsets[0].Int(0, file.Length - begin), end = offsets[1].Int(first, file.Length - begin);
                found.Add(one.Key, Values(file, begin + first, end - first, one.Value.At("dtype")));
            }
            return found;
        }

        private static double[] Values(byte[] file, int at, int bytes, Json dtype) {
            switch (dtype.One("F64", "F32", "I64", "I32", "U32", "U16", "U8")) {
                case "F64": return Each(bytes / 8, i => BitConverter.ToDouble(file, at + 8 * i));
                case "F32": return Each(bytes / 4, i => BitConverter.ToSingle(file, at + 4 * i));
                case "I64": return Each(bytes / 8, i => BitConverter.ToInt64(file, at + 8 * i));
                case "I32": return Each(bytes / 4, i => BitConverter.ToInt32(file, at + 4 * i));
                case "U32": return Each(bytes / 4, i => BitConverter.ToUInt32(file, at + 4 * i));
                case "U16": return Each(bytes / 2, i => BitConverter.ToUInt16(file, at + 2 * i));
                default: return Each(bytes, i => file[at + i]);
            }
        }

        private static double[] Each(int count, Func<int, double> element) {
            var found = new double[count];
            for (int i = 0; i < count; i++) found[i] = element(i);
            return found;
        }
    }
}
