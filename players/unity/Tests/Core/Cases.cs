using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Runtime.CompilerServices;
using System.Security.Cryptography;
using System.Text;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>What Python wrote into the folder AVATAR_CASES for these tests; without it they are ignored.</summary>
    internal static class Cases {
        /// <summary>Rounding of float32.</summary>
        public const double Rounding = 1.0 / (1 << 24);

        public static byte[] Bytes(params string[] path) {
            string folder = Environment.GetEnvironmentVariable("AVATAR_CASES");
            if (string.IsNullOrEmpty(folder)) Assert.Ignore("AVATAR_CASES is not set: `make test` writes the cases");
            return File.ReadAllBytes(path.Aggregate(folder, Path.Combine));
        }

        public static string Text(params string[] path) => Encoding.UTF8.GetString(Bytes(path));

        public static Json Read(params string[] path) => new Json(JsonText.Parse(Text(path)), path.Last());

        /// <summary>The arrays of a safetensors file.</summary>
        public static Dictionary<string, double[]> Tensors(params string[] path) => Vectors.Read(Bytes(path));

        public static string[] Packs() => Read("packs.json").At("packs").Names();

        /// <summary>The pack in a folder of the cases.</summary>
        public static LoadedAvatar Loaded(params string[] folder) {
            return LoadedAvatar.Load(Bytes(folder.Concat(new[] { "pack.avatar" }).ToArray()), folder.Last());
        }

        /// <summary>A pack that lies beside these tests, also in Unity.</summary>
        public static LoadedAvatar Golden(string name, [CallerFilePath] string here = "") {
            string path = Path.Combine(Path.GetDirectoryName(here), "Packs", name + ".avatar.bytes");
            return LoadedAvatar.Load(File.ReadAllBytes(path), name);
        }

        public static double[] Numbers(this Json said) => said.List().Select(one => one.Number()).ToArray();

        /// <summary>SHA-256 of the bytes of an array, as hexadecimal digits.</summary>
        public static string Sha(Array array) {
            byte[] bytes = new byte[Buffer.ByteLength(array)];
            Buffer.BlockCopy(array, 0, bytes, 0, bytes.Length);
            using (SHA256 hash = SHA256.Create()) {
                return string.Concat(hash.ComputeHash(bytes).Select(one => one.ToString("x2")).ToArray());
            }
        }
    }
}
