using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Runtime.CompilerServices;
using System.Security.Cryptography;
using System.Text;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests
{
    /// <summary>What Python wrote into the folder AVATAR_CASES for these tests; without it they are ignored.</summary>
    internal static class Cases
    {
        /// <summary>Rounding of float32.</summary>
        public const double Rounding = 1.0 / (1 << 24);

        /// <summary>A file's bytes.</summary>
        public static byte[] Bytes(params string[] path)
        {
            return File.ReadAllBytes(At(path));
        }

        /// <summary>A file as JSON.</summary>
        public static Json Read(params string[] path)
        {
            return new Json(JsonText.Parse(File.ReadAllText(At(path), Encoding.UTF8)), path.Last());
        }

        /// <summary>Names of the packs.</summary>
        public static string[] Packs()
        {
            return Read("packs.json").At("packs").Names();
        }

        /// <summary>A pack of that name, loaded.</summary>
        public static Core.Avatar Loaded(string name)
        {
            return Pack.Read(Bytes(name, "pack.avatar"), name);
        }

        /// <summary>The bytes of a pack that lies beside these tests, also in Unity.</summary>
        public static byte[] Golden(string name, [CallerFilePath] string here = "")
        {
            return File.ReadAllBytes(Path.Combine(Path.GetDirectoryName(here), "Packs", name + ".avatar.bytes"));
        }

        /// <summary>SHA-256 of the bytes of an array, as hexadecimal digits.</summary>
        public static string Sha(Array array)
        {
            byte[] bytes = new byte[System.Buffer.ByteLength(array)];
            System.Buffer.BlockCopy(array, 0, bytes, 0, bytes.Length);
            using (SHA256 hash = SHA256.Create())
            {
                return string.Concat(hash.ComputeHash(bytes).Select(one => one.ToString("x2")).ToArray());
            }
        }

        /// <summary>The arrays of a safetensors file.</summary>
        public static Dictionary<string, Tensor> Tensors(params string[] path)
        {
            byte[] file = Bytes(path);
            int length = (int)BitConverter.ToUInt64(file, 0);
            Json header = new Json(JsonText.Parse(Encoding.UTF8.GetString(file, 8, length)), "header");
            return header.Entries().Where(one => one.Key != "__metadata__").ToDictionary(
                one => one.Key, one => new Tensor(one.Value, file, 8 + length));
        }

        private static string At(string[] path)
        {
            string folder = Environment.GetEnvironmentVariable("AVATAR_CASES");
            if (string.IsNullOrEmpty(folder)) Assert.Ignore("AVATAR_CASES is not set: `make test` writes the cases");
            return path.Aggregate(folder, Path.Combine);
        }
    }

    /// <summary>An array of a safetensors file. Row t begins at t times Row.</summary>
    internal sealed class Tensor
    {
        public readonly int[] Shape;
        public readonly double[] Values;

        public Tensor(Json said, byte[] file, int body)
        {
            Shape = said.At("shape").List().Select(length => length.Int()).ToArray();
            int begin = body + said.At("data_offsets").List()[0].Int();
            string type = said.At("dtype").Text();
            int size = type.EndsWith("64") ? 8 : 4;
            int count = Shape.Aggregate(1, (product, length) => product * length);
            Values = Enumerable.Range(0, count).Select(i => Number(type, file, begin + size * i)).ToArray();
        }

        /// <summary>Numbers of a row.</summary>
        public int Row
        {
            get { return Shape[0] == 0 ? 0 : Values.Length / Shape[0]; }
        }

        private static double Number(string type, byte[] file, int at)
        {
            switch (type)
            {
                case "F32": return BitConverter.ToSingle(file, at);
                case "F64": return BitConverter.ToDouble(file, at);
                case "I32": return BitConverter.ToInt32(file, at);
                case "U32": return BitConverter.ToUInt32(file, at);
                case "I64": return BitConverter.ToInt64(file, at);
                default: throw new ArgumentException(type);
            }
        }
    }
}
