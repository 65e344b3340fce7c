using UnityEngine;

namespace AvatarExport {
    /// <summary>What the importer does.</summary>
    public sealed partial class GaussianAvatar {
        /// <summary>
        /// Takes an asset, and the objects that AvatarRig.Build made below this one, as if they had been saved so. The avatar is
        /// shown when the object is next enabled. "mesh" is null for an asset that cannot be loaded.
        /// </summary>
        internal void Adopt(GaussianAvatarAsset imported, SkinnedMeshRenderer mesh, Transform[] joints) {
            asset = imported;
            proxy = mesh;
            rigRoot = mesh == null ? null : mesh.transform.parent;
            bones = joints;
        }
    }
}
