using System;
using System.IO;
using System.Runtime.CompilerServices;

namespace AvatarExport.Tests
{
    /// <summary>The packs of Tests/Core/Packs.</summary>
    internal static class Packs
    {
        /// <summary>With a rig and clips, right-handed.</summary>
        public const string Joints = "joints";

        /// <summary>With splats on a mesh that a rig moves.</summary>
        public const string Surface = "surface";

        /// <summary>Without a rig, right-handed.</summary>
        public const string WithoutRig = "surface_without_rig";

        /// <summary>The bytes of a pack.</summary>
        public static byte[] Bytes(string name, [CallerFilePath] string here = "")
        {
            string folder =
                Environment.GetEnvironmentVariable("AVATAR_TESTS") ?? Path.Combine(Path.GetDirectoryName(here), "..");
            return File.ReadAllBytes(Path.Combine(folder, "Core", "Packs", name + ".avatar.bytes"));
        }

        /// <summary>A pack, read.</summary>
        public static Core.Avatar Read(string name)
        {
            return Core.Pack.Read(Bytes(name), name);
        }
    }
}
