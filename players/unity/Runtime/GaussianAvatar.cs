using System;
using System.Collections.Generic;
using System.Threading.Tasks;
using AvatarExport.Core;
using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport {
    /// <summary>What the skinned mesh below an avatar is for, besides carrying blend shapes.</summary>
    public enum ProxyUse {
        /// <summary>Nothing: it is not drawn.</summary>
        Hidden,

        /// <summary>The avatar casts shadows. Splats receive none.</summary>
        Shadows,

        /// <summary>It is drawn itself, in a plain material.</summary>
        Visible,
    }

    /// <summary>An expression and its weight: 0 is rest, 1 is full; other values are allowed.</summary>
    [Serializable]
    public struct ExpressionWeight {
        /// <summary>Name or alias.</summary>
        public string Name;

        /// <summary>The weight.</summary>
        public float Weight;
    }

    /// <summary>
    /// Shows an avatar of 3D Gaussians, posed by a clip, by blend shapes and bones, by scripts, or by ARKit input: of
    /// sources that set the same value the last one named here wins. Lights do not change it. Any transform will do.
    /// </summary>
    [ExecuteAlways]
    [DefaultExecutionOrder(1000)] // after other scripts, which may move bones in their LateUpdate
    [DisallowMultipleComponent]
    [AddComponentMenu("Gaussian Avatar/Gaussian Avatar")]
    public sealed partial class GaussianAvatar : MonoBehaviour {
        [SerializeField, Tooltip("An imported NAME.avatar. Scripts may call Load instead.")]
        private GaussianAvatarAsset asset;

        [SerializeField, Tooltip("Hides the splats. Blend shapes and bones still move.")]
        private bool visible = true;

        [SerializeField,
            Tooltip("Level of detail, 0 the finest. -1: chosen by the height of the avatar on the screen.")]
        private int level = -1;

        [SerializeField, Tooltip("Expressions that are set here or by scripts.")]
        private List<ExpressionWeight> expressions = new List<ExpressionWeight>();

        [SerializeField, Tooltip("Clip of the file that is played; empty: none.")]
        private string clip = "";

        [SerializeField, Tooltip("Plays the clip again from its beginning.")]
        private bool loop = true;

        [SerializeField, Tooltip("Live Link Face, or ARFoundation's face. Empty: none.")]
        private ArkitSource liveInput;

        [SerializeField, Tooltip("Shadows: the skinned mesh casts them. Visible: it is drawn.")]
        private ProxyUse proxyUse = ProxyUse.Hidden;

        [SerializeField,
            Tooltip("Splats follow the skinned mesh as Unity deforms it, for Cloth and tools that change it. Slower.")]
        private bool followProxy;

        [SerializeField, HideInInspector]
        private SkinnedMeshRenderer proxy;

        [SerializeField, HideInInspector]
        private Transform rigRoot;

        [SerializeField, HideInInspector]
        private Transform[] bones = new Transform[0];

        private LoadedAvatar avatar;
        private Instance instance;
        private Clip playing;
        private PoseLayers layers;
        private RigLink rig;
        private Bounds localBounds;
        private double clipSeconds;

        /// <summary>The imported file. Setting it shows it, or nothing for null.</summary>
        public GaussianAvatarAsset Asset {
            get => asset;
            set {
                asset = value;
                Reload();
            }
        }

        /// <summary>What is shown: its names, clips and levels; null if nothing is.</summary>
        public LoadedAvatar Avatar => avatar;

        /// <summary>The pose that is shown now; null if nothing is. It is written again in each LateUpdate.</summary>
        public AvatarPose Pose => instance == null ? null : instance.Pose;

        /// <summary>Whether splats are drawn.</summary>
        public bool Visible {
            get => visible;
            set => visible = value;
        }

        /// <summary>Level of detail, 0 the finest; -1 chooses by the height of the avatar on the screen.</summary>
        public int Level {
            get => level;
            set => level = value;
        }

        /// <summary>Where ARKit input comes from; null: none.</summary>
        public ArkitSource LiveInput {
            get => liveInput;
            set => liveInput = value;
        }

        /// <summary>What the skinned mesh is for.</summary>
        public ProxyUse ProxyUse {
            get => proxyUse;
            set {
                proxyUse = value;
                ApplyProxyUse();
            }
        }

        /// <summary>
        /// Whether splats follow the skinned mesh as Unity deforms it: a Cloth, or a tool that changes the mesh. It
        /// costs a copy of the mesh each frame, and the pose correctives of bodies. Splats that no mesh moves stay as
        /// they are.
        /// </summary>
        public bool FollowProxy {
            get => followProxy;
            set => followProxy = value;
        }

        /// <summary>The renderer whose blend shapes are the expressions; null before the avatar is loaded.</summary>
        public SkinnedMeshRenderer Proxy => proxy;

        /// <summary>The bones in the order of Avatar.Skeleton.Names; empty without a rig.</summary>
        public IReadOnlyList<Transform> Bones => bones;

        /// <summary>Seconds into the clip.</summary>
        public double ClipSeconds {
            get => clipSeconds;
            set => clipSeconds = value;
        }

        /// <summary>The box over all poses, world space.</summary>
        public Bounds WorldBounds => Boxes.Of(transform.localToWorldMatrix, localBounds);

        /// <summary>
        /// Where a ray meets the box over all poses, units along the ray; false if it does not. A MeshCollider is
        /// finer.
        /// </summary>
        public bool Raycast(Ray ray, out float distance) => WorldBounds.IntersectRay(ray, out distance);

        /// <summary>
        /// Shows a pack. "file" is the whole file. Throws AvatarError, and shows what it did before, for one that is
        /// not sound.
        /// </summary>
        public void Load(byte[] file, string nameInErrors = "avatar") {
            LoadedAvatar read = LoadedAvatar.Load(file, nameInErrors);
            asset = shownAsset = null;
            Show(read);
        }

        /// <summary>
        /// Loads a pack from a URL, or from a path below StreamingAssets, and shows it. The task fails with AvatarError
        /// that says what is wrong. If this object is gone or shows something else by then, nothing is shown.
        /// </summary>
        public async Task LoadAsync(string urlOrPath) {
            int asked = ++loads;
            string address = PackDownload.AddressOf(urlOrPath);
            byte[] file = await PackDownload.Of(address);
            if (this != null && asked == loads) Load(file, address);
        }

        /// <summary>
        /// Sets an expression, over clips and blend shapes, until ClearExpression. Throws AvatarError for an unknown
        /// name or if no avatar is shown.
        /// </summary>
        public void SetExpression(string expression, float weight) {
            Shown().SetExpression(expression, weight);
            int at = IndexOf(expression);
            if (at < 0) expressions.Add(default(ExpressionWeight));
            expressions[at < 0 ? expressions.Count - 1 : at] = new ExpressionWeight { Name = expression, Weight = weight };
        }

        /// <summary>The weight of an expression that was set here; 0 for one that was not.</summary>
        public float GetExpression(string expression) {
            int at = IndexOf(expression);
            return at < 0 ? 0 : expressions[at].Weight;
        }

        /// <summary>Leaves an expression to clips and blend shapes again.</summary>
        public void ClearExpression(string expression) {
            for (int at = IndexOf(expression); at >= 0; at = IndexOf(expression)) expressions.RemoveAt(at);
            if (layers != null) layers.ClearExpression(expression);
        }

        /// <summary>Sets an eyelid by name, as SetExpression.</summary>
        public void SetEyelid(string eyelid, float weight) => Shown().SetEyelid(eyelid, weight);

        /// <summary>
        /// Turns a joint from its rest pose, in the joint's own frame, over clips and bones. Throws AvatarError as
        /// SetExpression.
        /// </summary>
        public void SetJoint(string joint, Quaternion turn) {
            PoseLayers shown = Shown();
            Vector3 vector = Turns.VectorOf(turn);
            // Unity is left-handed: in the person's frame, its mirror, a rotation vector keeps x and negates y and z.
            shown.SetJoint(joint, vector.x, -vector.y, -vector.z);
        }

        /// <summary>
        /// Takes back all that scripts, blend shapes and bones have set: what they set from now on counts again.
        /// </summary>
        public void ResetPose() {
            expressions.Clear();
            if (layers != null) layers.ClearScript();
            if (rig != null) rig.Release();
        }

        /// <summary>
        /// Plays a clip of the file from its beginning. Throws AvatarError for an unknown name or if no avatar is
        /// shown.
        /// </summary>
        public void Play(string clipName, bool again = true) {
            Shown();
            playing = ClipNamed(clipName);
            clip = clipName;
            loop = again;
            clipSeconds = 0;
        }

        /// <summary>Plays no clip any more.</summary>
        public void Stop() {
            playing = null;
            clip = "";
        }

        private int IndexOf(string expression) {
            for (int i = 0; i < expressions.Count; i++) {
                if (expressions[i].Name == expression) return i;
            }
            return -1;
        }

        private PoseLayers Shown() {
            if (layers != null) return layers;
            throw new AvatarError("shows no avatar; set Asset, or call Load", name);
        }

        private Clip ClipNamed(string clipName) {
            Clip found = Array.Find(avatar.Clips, one => one.Name == clipName);
            if (found != null) return found;
            string[] names = Array.ConvertAll(avatar.Clips, one => one.Name);
            throw AvatarError.NoSuch("clip of this avatar", clipName, names, "clips", avatar.Name);
        }
    }
}
