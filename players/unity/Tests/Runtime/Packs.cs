using System;
using System.IO;
using System.Runtime.CompilerServices;
using AvatarExport.Core;

namespace AvatarExport.Tests {
    /// <summary>The packs of Tests/Core/Packs.</summary>
    internal static class Packs {
        /// <summary>With a rig and clips, right-handed.</summary>
        public const string Joints = "joints";

        /// <summary>With splats on a mesh that a rig moves.</summary>
        public const string Surface = "surface";

        /// <summary>Without a rig, right-handed.</summary>
        public const string WithoutRig = "surface_without_rig";

        public static byte[] Bytes(string name, [CallerFilePath] string here = "") {
            string folder = Environment.GetEnvironmentVariable("AVATAR_TESTS") ?? Path.Combine(Path.GetDirectoryName(here), "..");
            return File.ReadAllBytes(Path.Combine(folder, "Core", "Packs", name + ".avatar.bytes"));
        }

        public static LoadedAvatar Read(string name) => LoadedAvatar.Load(Bytes(name), name);
    }
}
