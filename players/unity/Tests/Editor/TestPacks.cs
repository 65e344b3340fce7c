using System.IO;
using System.Runtime.CompilerServices;
using AvatarExport.Core;

namespace AvatarExport.Tests {
    /// <summary>
    /// Packs that lie in this package: "head" and "body" of the samples, left-handed, the head with 51 expressions, 2
    /// eyelids, 5 bones, 2 clips; and small ones of the tests of Core: "joints", right-handed, or "surface_without_rig".
    /// </summary>
    internal static class TestPacks {
        public static byte[] Bytes(string name) {
            string package = Path.Combine(Path.GetDirectoryName(Here()), "..", "..");
            string folder = name == "head" ? "Head" : name == "body" ? "Body" : null;
            return File.ReadAllBytes(folder == null
                ? Path.Combine(package, "Tests", "Core", "Packs", name + ".avatar.bytes")
                : Path.Combine(package, "Samples~", folder, "Resources", "sample_" + name + ".avatar"));
        }

        private static string Here([CallerFilePath] string here = "") => here;

        public static LoadedAvatar Read(string name) => LoadedAvatar.Load(Bytes(name), name);
    }
}
