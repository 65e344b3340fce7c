using System;
using AvatarExport.Core;
using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport {
    /// <summary>What Unity calls, and what the scene of avatars asks for.</summary>
    public sealed partial class GaussianAvatar {
        private static Material plain; // of the Built-in pipeline

        private Resident resident;
        private Mesh ownMesh; // made by Load, not by an importer
        private readonly ProxyVertices vertices = new ProxyVertices();
        private GaussianAvatarAsset shownAsset;
        private bool edited; // in the inspector
        private bool failed; // this device cannot show it; told already
        private int loads;
        private bool linked; // there are objects below for the avatar that is shown
        private int chosenLevel;

        private void OnEnable() {
            AvatarScene.Shared.Add(this);
            if (avatar == null) Reload();
            else ApplyProxyUse();
        }

        private void OnDisable() {
            FreeGpu();
            vertices.Forget();
            AvatarScene.Shared.Remove(this);
        }

        private void OnDestroy() {
            loads++;
            Objects.Destroy(ownMesh); // the objects below go with this one
        }

        private void OnValidate() {
            edited = true; // objects must not be destroyed here
        }

        private void LateUpdate() {
            if (edited) TakeEdits();
            if (instance == null) return;
            if (playing != null) Advance();
            UpdatePose();
            ChooseLevel();
        }

        private void OnDrawGizmos() {
            // Seen by the picking of the scene view alone: a click selects the avatar.
            Gizmos.color = Color.clear;
            Bounds box = WorldBounds;
            if (instance != null) Gizmos.DrawCube(box.center, box.size);
        }

        private void TakeEdits() {
            edited = false;
            if (shownAsset != asset) Reload();
            if (layers == null) return;
            layers.ClearScript();
            ApplyExpressions();
            ApplyProxyUse();
            if (playing == null || playing.Name != clip) StartClip();
        }

        private void UpdatePose() {
            if (linked && (rigRoot == null || rig != null && !rig.IsWhole)) MakeRig(); // somebody deleted objects
            layers.Mix(instance.Pose, playing, clipSeconds, rig, liveInput);
            instance.UpdatePose();
            if (followProxy && rig != null && avatar.Program.ReadsMesh) {
                vertices.Read(proxy, avatar.Handedness == "right");
            } else vertices.Forget();
        }

        /// <summary>Shows the asset anew: after it was imported again, or set.</summary>
        public void Reload() {
            Clear();
            shownAsset = asset;
            if (asset == null) return;
            try {
                Show(asset.Load());
            } catch (AvatarError error) {
                Debug.LogError(error.Message, this);
            }
        }

        /// <summary>Whether a camera draws this avatar. "planes" are those of its frustum.</summary>
        internal bool IsSeenBy(Camera camera, Plane[] planes) {
            if (!visible || failed || instance == null || (camera.cullingMask & 1 << gameObject.layer) == 0) {
                return false;
            }
            return IsInSceneOf(camera) && GeometryUtility.TestPlanesAABB(planes, WorldBounds);
        }

        /// <summary>
        /// What the GPU holds for a camera that draws this avatar; null, told once, where this device cannot.
        /// </summary>
        internal Resident ResidentForCamera() {
            CameraMatrices.WritePlace(transform.localToWorldMatrix, instance.Place);
            // While a scene is edited LateUpdate is not called for each picture: a preview of a Timeline moves bones between.
            if (!Application.isPlaying) UpdatePose();
            if (resident != null) return resident;
            try {
                string lack = Device.Lack();
                if (lack != null) throw new AvatarError(lack + ". Its skinned mesh is shown instead", avatar.Name);
                resident = new Resident(instance, vertices);
            } catch (AvatarError error) {
                failed = true;
                Warnings.Once(error.Message, this);
                ApplyProxyUse();
            }
            return resident;
        }

        private void Show(LoadedAvatar shown) {
            Clear();
            avatar = shown;
            instance = new Instance(shown, FirstLevel(shown));
            chosenLevel = instance.Level;
            layers = new PoseLayers(shown);
            localBounds = AvatarRig.LocalBounds(shown);
            MakeRig();
            ApplyExpressions();
            StartClip();
            edited = false; // all of it is shown; a later look would take back what scripts set until then
        }

        private void MakeRig() {
            rig = null;
            linked = false;
            if (IsRigOfAnother()) DropRig();
            try {
                if (proxy == null) BuildOwnRig();
                linked = true;
                LinkRig();
            } catch (AvatarError error) {
                Debug.LogWarning(error.Message, this); // splats are shown without it
            }
            ApplyProxyUse();
        }

        /// <summary>
        /// A copy of an avatar whose rig is not saved has a copy of that rig, and no mesh of its own.
        /// </summary>
        private bool IsRigOfAnother() {
            if (proxy == null || rigRoot == null || ownMesh != null) return false;
            Mesh mesh = proxy.sharedMesh; // both have the same
            return rigRoot.gameObject.hideFlags == HideFlags.DontSave
                || mesh != null && mesh.hideFlags == HideFlags.DontSave;
        }

        private void BuildOwnRig() {
            Objects.Destroy(ownMesh);
            ownMesh = AvatarRig.MakeMesh(avatar);
            ownMesh.hideFlags = HideFlags.DontSave;
            bones = AvatarRig.Build(transform, avatar, ownMesh, HideFlags.DontSave, out proxy);
            rigRoot = proxy.transform.parent;
        }

        private void Clear() {
            FreeGpu();
            rig = null;
            linked = false;
            layers = null;
            instance = null;
            avatar = null;
            playing = null;
            failed = false;
            if (ownMesh == null) return;
            DropRig();
            Objects.Destroy(ownMesh);
            ownMesh = null;
        }

        private void DropRig() {
            if (rigRoot != null) Objects.Destroy(rigRoot.gameObject);
            proxy = null;
            rigRoot = null;
            bones = new Transform[0];
        }

        private void FreeGpu() {
            if (resident == null) return;
            AvatarScene.Shared.Forget();
            resident.Dispose();
            resident = null;
        }

        private void StartClip() {
            playing = null;
            if (string.IsNullOrEmpty(clip)) return;
            try {
                playing = ClipNamed(clip);
            } catch (AvatarError error) {
                Debug.LogWarning(error.Message, this);
            }
        }

        private void Advance() {
            clipSeconds += Application.isPlaying ? Time.deltaTime : 0;
            if (!loop || clipSeconds <= playing.Seconds) return;
            clipSeconds = playing.Seconds > 0 ? clipSeconds % playing.Seconds : 0;
        }

        /// <summary>
        /// A rig of another avatar, of an asset that was exchanged, does not fit: it is left alone, and told.
        /// </summary>
        private void LinkRig() {
            int joints = avatar.Skeleton == null ? 0 : avatar.Skeleton.Names.Length;
            if (rigRoot == null || bones.Length != joints || Array.Exists(bones, bone => bone == null)) {
                string told = $"{name}: the bones below it are not those of {AvatarError.Plain(avatar.Name)}; ";
                Debug.LogWarning(told + "delete the object " + AvatarRig.RootName, this);
                return;
            }
            rig = new RigLink(avatar, rigRoot, proxy, bones);
        }

        private void ApplyExpressions() {
            foreach (ExpressionWeight one in expressions) {
                try {
                    layers.SetExpression(one.Name, one.Weight);
                } catch (AvatarError error) {
                    Debug.LogWarning(error.Message, this); // of an avatar that was shown before
                }
            }
        }

        private void ApplyProxyUse() {
            if (proxy == null) return;
            bool drawn = failed || proxyUse != ProxyUse.Hidden;
            proxy.enabled = drawn;
            bool alone = failed || proxyUse == ProxyUse.Visible;
            proxy.shadowCastingMode = alone ? ShadowCastingMode.On : ShadowCastingMode.ShadowsOnly;
            if (!drawn || proxy.sharedMaterial != null) return;
            proxy.sharedMaterial = PlainMaterial();
            if (proxy.sharedMaterial != null) return;
            Warnings.Once($"{name}: its mesh has no material in a build; set one on {AvatarRig.ProxyPath}", this);
        }

        /// <summary>A material of the pipeline. Null in a build, where pipelines keep theirs to the Editor.</summary>
        private static Material PlainMaterial() {
            RenderPipelineAsset pipeline = GraphicsSettings.currentRenderPipeline;
            if (pipeline != null) return pipeline.defaultMaterial;
            Shader diffuse = Shader.Find("Legacy Shaders/Diffuse"); // a project includes it always unless it is told not to
            if (plain == null && diffuse != null) plain = new Material(diffuse) { hideFlags = HideFlags.HideAndDontSave };
            return plain;
        }

        private int FirstLevel(LoadedAvatar shown) {
            return level < 0 ? 0 : Mathf.Min(level, shown.Program.Levels.Length - 1);
        }

        private void ChooseLevel() {
            int wanted = level < 0 ? Automatic() : FirstLevel(avatar);
            if (wanted == chosenLevel) return;
            FreeGpu();
            instance.Level = chosenLevel = wanted;
        }

        /// <summary>The level for the height that was seen.</summary>
        private int Automatic() {
            double height = resident == null ? 0 : resident.TakeHeightPx();
            return height > 0 ? Levels.Next(avatar.Levels, height, chosenLevel) : chosenLevel;
        }

        /// <summary>
        /// Cameras of a preview or of an opened prefab show their own scene alone, and all others no such scene.
        /// </summary>
        private bool IsInSceneOf(Camera camera) {
            if (camera.scene.IsValid()) return camera.scene == gameObject.scene;
#if UNITY_EDITOR
            return !UnityEditor.SceneManagement.EditorSceneManager.IsPreviewSceneObject(gameObject);
#else
            return true;
#endif
        }
    }
}
