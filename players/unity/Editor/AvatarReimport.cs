using System;
using UnityEditor;
using UnityEngine;

namespace AvatarExport.Editor {
    /// <summary>Avatars in open scenes show a file anew when it was imported again.</summary>
    internal sealed class AvatarReimport : AssetPostprocessor {
        // Called by Unity, by this name, after any import.
        private static void OnPostprocessAllAssets(string[] imported, string[] deleted, string[] moved, string[] movedFrom) {
            if (Array.Exists(imported, IsPack)) Reload(imported);
        }

        private static bool IsPack(string path) => path.EndsWith(".avatar", StringComparison.OrdinalIgnoreCase);

        /// <summary>Reloads the avatars of open scenes whose files are among "imported".</summary>
        internal static void Reload(string[] imported) {
            foreach (GaussianAvatar one in Resources.FindObjectsOfTypeAll<GaussianAvatar>()) {
                bool inScene = !EditorUtility.IsPersistent(one) && one.isActiveAndEnabled;
                if (inScene && one.Asset != null && Array.IndexOf(imported, AssetDatabase.GetAssetPath(one.Asset)) >= 0) one.Reload();
            }
        }
    }
}
