using System.Collections.Generic;
using UnityEngine;

namespace AvatarExport {
    /// <summary>
    /// The vertices of a skinned mesh as Unity deforms it, cloth included, as buffer Mesh holds them.
    /// </summary>
    internal sealed class ProxyVertices {
        private readonly List<Vector3> vertices = new List<Vector3>();
        private float[] floats;
        private Mesh baked;
        private bool changed;

        /// <summary>[V, 4] x, y, z, 1 in the frame of the pack; null where the avatar poses its own mesh.</summary>
        public float[] Floats { get; private set; }

        /// <summary>Reads the mesh as it is now. "mirrored" for a right-handed pack.</summary>
        public void Read(SkinnedMeshRenderer proxy, bool mirrored) {
            if (baked == null) baked = new Mesh { hideFlags = HideFlags.HideAndDontSave };
            proxy.BakeMesh(baked, true);
            baked.GetVertices(vertices);
            if (floats == null || floats.Length != 4 * vertices.Count) floats = new float[4 * vertices.Count];
            float sign = mirrored ? -1 : 1;
            for (int i = 0; i < vertices.Count; i++) {
                Vector3 at = vertices[i];
                floats[4 * i] = sign * at.x;
                floats[4 * i + 1] = at.y;
                floats[4 * i + 2] = at.z;
                floats[4 * i + 3] = 1;
            }
            Floats = floats;
            changed = true;
        }

        /// <summary>The avatar poses its own mesh again.</summary>
        public void Forget() {
            changed |= Floats != null;
            Floats = null;
            Objects.Destroy(baked);
            baked = null;
        }

        /// <summary>Whether Floats has changed since the last call.</summary>
        public bool TakeChange() {
            bool was = changed;
            changed = false;
            return was;
        }
    }
}
