using System.IO;
using System.Runtime.CompilerServices;

namespace AvatarExport.Tests
{
    /// <summary>Packs that lie in this package.</summary>
    internal static class TestPacks
    {
        /// <summary>Bytes of the head of the samples: left-handed, 51 expressions, 2 eyelids, 5 bones, 2 clips.</summary>
        public static byte[] Head()
        {
            return File.ReadAllBytes(Path.Combine(Package(), "Samples~", "Head", "Resources", "sample_head.avatar"));
        }

        /// <summary>Bytes of the body of the samples: embedded in its mesh, without expressions.</summary>
        public static byte[] Body()
        {
            return File.ReadAllBytes(Path.Combine(Package(), "Samples~", "Body", "Resources", "sample_body.avatar"));
        }

        /// <summary>Bytes of a small pack of the tests of Core: "joints", right-handed, or "surface_without_rig".</summary>
        public static byte[] Golden(string name)
        {
            return File.ReadAllBytes(Path.Combine(Package(), "Tests", "Core", "Packs", name + ".avatar.bytes"));
        }

        private static string Package([CallerFilePath] string here = "")
        {
            return Path.GetDirectoryName(Path.GetDirectoryName(Path.GetDirectoryName(here)));
        }
    }
}
