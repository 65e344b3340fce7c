using System;
using AvatarExport.Core;
using UnityEngine;

namespace AvatarExport {
    /// <summary>An imported pack. The importer has checked it; Load decodes it once for all that show it.</summary>
    [PreferBinarySerialization]
    public sealed class GaussianAvatarAsset : ScriptableObject {
        [SerializeField, HideInInspector]
        private byte[] bytes = new byte[0];

        [SerializeField, HideInInspector]
        private string problem = "";

        [NonSerialized]
        private LoadedAvatar loaded;

        [NonSerialized]
        private byte[] loadedFrom; // importing again gives other bytes

        /// <summary>The file.</summary>
        public byte[] Bytes {
            get => bytes;
            set {
                bytes = value;
                problem = "";
            }
        }

        /// <summary>Holds no file, and says from now on why: "message" is that of the importer.</summary>
        internal void Refuse(string message) {
            Bytes = new byte[0];
            problem = message;
        }

        /// <summary>
        /// The avatar, checked and decoded on the first call. Throws AvatarError for a file that is not sound.
        /// </summary>
        public LoadedAvatar Load() {
            if (!string.IsNullOrEmpty(problem)) throw new AvatarError(problem);
            if (loaded != null && ReferenceEquals(loadedFrom, bytes)) return loaded;
            loaded = LoadedAvatar.Load(bytes, name);
            loadedFrom = bytes;
            return loaded;
        }
    }
}
