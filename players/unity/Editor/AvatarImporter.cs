using System;
using System.Collections.Generic;
using System.IO;
using AvatarExport.Core;
using UnityEditor.AssetImporters;
using UnityEngine;

namespace AvatarExport.Editor {
    /// <summary>
    /// Makes of NAME.avatar what can be dragged into a scene: a prefab with the component, a hidden skinned mesh, bones and an
    /// Animator; beside it the asset, the mesh and the clips. A file that cannot be used gives one error in the Console and an
    /// empty prefab whose asset says what is wrong.
    /// </summary>
    [ScriptedImporter(1, "avatar")]
    public sealed class AvatarImporter : ScriptedImporter {
        private const int IconPixels = 128;

        /// <summary>Called by Unity when the file is new or has changed.</summary>
        public override void OnImportAsset(AssetImportContext ctx) {
            string file = Path.GetFileName(ctx.assetPath);
            GaussianAvatarAsset asset = ScriptableObject.CreateInstance<GaussianAvatarAsset>();
            asset.name = Path.GetFileNameWithoutExtension(file);
            ctx.AddObjectToAsset("asset", asset);
            var owner = new GameObject(asset.name);
            Parts parts = null;
            try {
                byte[] bytes = File.ReadAllBytes(ctx.assetPath);
                parts = Make(owner.transform, LoadedAvatar.Load(bytes, file));
                asset.Bytes = bytes;
            } catch (Exception error) when (error is AvatarError || error is IOException || error is UnauthorizedAccessException) {
                DestroyImmediate(owner); // it may be half made
                owner = new GameObject(asset.name);
                string message = (error as AvatarError)?.Of(file).Message ?? error.Message;
                asset.Refuse(message);
                ctx.LogImportError(message, asset);
            }
            Add(ctx, owner, asset, parts ?? new Parts());
            ctx.SetMainObject(owner);
        }

        /// <summary>What is made of an avatar, besides the prefab. Nothing of a file that cannot be used.</summary>
        private sealed class Parts {
            internal Mesh Mesh;
            internal Texture2D Icon;
            internal SkinnedMeshRenderer Proxy;
            internal Transform[] Bones = new Transform[0];
            internal readonly List<AnimationClip> Clips = new List<AnimationClip>();
        }

        /// <summary>Throws AvatarError for a rig that bones or blend shapes cannot show.</summary>
        private static Parts Make(Transform owner, LoadedAvatar avatar) {
            var parts = new Parts { Mesh = AvatarRig.MakeMesh(avatar), Icon = IconOf(avatar) };
            parts.Bones = AvatarRig.Build(owner, avatar, parts.Mesh, HideFlags.None, out parts.Proxy);
            string[] shapes = GaussianAvatarEditor.Names(parts.Mesh);
            RigPaths paths = RigPaths.Below(owner, parts.Proxy, parts.Bones);
            var names = new HashSet<string>();
            foreach (Clip clip in avatar.Clips) {
                AnimationClip made = ClipCurves.Of(avatar, clip, shapes, paths);
                for (int copy = 2; !names.Add(made.name); copy++) made.name = clip.Name + " " + copy;
                parts.Clips.Add(made);
            }
            return parts;
        }

        private static void Add(AssetImportContext ctx, GameObject owner, GaussianAvatarAsset asset, Parts parts) {
            // Others stop where no renderer is seen, and the proxy is not.
            owner.AddComponent<Animator>().cullingMode = AnimatorCullingMode.AlwaysAnimate;
            owner.AddComponent<GaussianAvatar>().Adopt(asset, parts.Proxy, parts.Bones);
            ctx.AddObjectToAsset("prefab", owner, parts.Icon);
            if (parts.Mesh == null) return;
            ctx.AddObjectToAsset("mesh", parts.Mesh);
            ctx.AddObjectToAsset("icon", parts.Icon);
            // Identified by name, so references hold when clips are added.
            foreach (AnimationClip clip in parts.Clips) ctx.AddObjectToAsset("clip " + clip.name, clip);
        }

        private static Texture2D IconOf(LoadedAvatar avatar) {
            var icon = new Texture2D(IconPixels, IconPixels, TextureFormat.RGBA32, false) { name = "icon" };
            icon.LoadRawTextureData(Icon.Draw(avatar, IconPixels));
            icon.Apply();
            icon.hideFlags = HideFlags.HideInHierarchy;
            return icon;
        }
    }
}
