// Stands in for Unity in tests: objects of a scene. Signatures are Unity's; bodies are ours.
using System;
using System.Collections.Generic;
using UnityEngine.Rendering;

namespace UnityEngine {
    [Flags]
    public enum HideFlags { None = 0, HideInHierarchy = 1, DontSave = 52, HideAndDontSave = 61 }

    public partial class Object {
        internal bool gone;
        private string called;
        public string name { get { return Named.called; } set { Named.called = value; } }
        public HideFlags hideFlags { get; set; }
        public static void Destroy(Object obj) { DestroyImmediate(obj); }
        public static void DestroyImmediate(Object obj) {
            if (obj == null) return;
            obj.gone = true;
            obj.OnGone();
        }
        public static bool operator ==(Object x, Object y) {
            bool left = ReferenceEquals(x, null) || x.gone, right = ReferenceEquals(y, null) || y.gone;
            return left || right ? left && right : ReferenceEquals(x, y);
        }
        public static bool operator !=(Object x, Object y) => !(x == y);
        public override bool Equals(object other) => ReferenceEquals(this, other);
        public override int GetHashCode() => System.Runtime.CompilerServices.RuntimeHelpers.GetHashCode(this);
        internal virtual void OnGone() { }
        internal virtual Object Named => this;
    }

    public partial class Component : Object {
        internal GameObject holder;
        internal override Object Named => holder == null ? (Object)this : holder;
        public GameObject gameObject => holder;
        public Transform transform => holder.transform;
        /// <summary>What the engine calls of a script.</summary>
        internal void Send(string message) {
            System.Reflection.MethodInfo method = GetType().GetMethod(
                message, System.Reflection.BindingFlags.Instance | System.Reflection.BindingFlags.NonPublic);
            if (method != null) method.Invoke(this, null);
        }
        public bool TryGetComponent<T>(out T component) { component = default(T); return false; }
    }

    public class Behaviour : Component {
        private bool on = true;
        public bool enabled { get { return on; } set { on = value; } }
        public bool isActiveAndEnabled => on && !gone;
    }

    public class MonoBehaviour : Behaviour { }
    public partial class ScriptableObject : Object { }

    public sealed partial class GameObject : Object {
        internal readonly List<Component> components = new List<Component>();
        public GameObject(string name) { this.name = name; transform = AddComponent<Transform>(); }
        public Transform transform { get; private set; }
        public int layer { get; set; }
        public SceneManagement.Scene scene => new SceneManagement.Scene();
        public T AddComponent<T>() where T : Component {
            var made = (T)Activator.CreateInstance(typeof(T));
            made.holder = this;
            components.Add(made);
            made.Send("OnEnable");
            return made;
        }
        internal override void OnGone() {
            foreach (Component one in components) {
                one.Send("OnDisable");
                one.Send("OnDestroy");
                one.gone = true;
            }
            foreach (Transform child in transform.children) DestroyImmediate(child.gameObject);
        }
    }

    public partial class Transform : Component {
        private Vector3 scale = Vector3.one;
        private Quaternion turn = Quaternion.identity;
        internal Matrix4x4 matrix = Matrix4x4.identity;
        public Transform parent { get; private set; }
        public Vector3 localPosition { get; set; }
        public Quaternion localRotation { get { return turn; } set { turn = value; } }
        public Vector3 localScale { get { return scale; } set { scale = value; } }
        public Quaternion rotation => turn;
        public Matrix4x4 localToWorldMatrix => matrix;
        internal readonly List<Transform> children = new List<Transform>();
        public void SetParent(Transform parent, bool worldPositionStays) {
            this.parent = parent;
            parent.children.Add(this);
        }
    }

    public class Renderer : Component {
        public bool enabled { get; set; }
        public ShadowCastingMode shadowCastingMode { get; set; }
        public Material sharedMaterial { get; set; }
        public Bounds localBounds { get; set; }
    }

    public class SkinnedMeshRenderer : Renderer {
        internal readonly Dictionary<int, float> weights = new Dictionary<int, float>();
        internal int writes;
        internal bool clamps;
        public Mesh sharedMesh { get; set; }
        public Transform rootBone { get; set; }
        public Transform[] bones { get; set; }
        public float GetBlendShapeWeight(int index) {
            if (gone) throw new InvalidOperationException("the renderer was destroyed");
            float w;
            return weights.TryGetValue(index, out w) ? w : 0;
        }
        public void SetBlendShapeWeight(int index, float value) { weights[index] = clamps ? Math.Min(value, 100) : value; writes++; }
        public void BakeMesh(Mesh mesh, bool useScale) { mesh.vertices = sharedMesh.vertices; }
    }

    public sealed partial class Mesh : Object {
        internal readonly List<string> shapes = new List<string>();
        public IndexFormat indexFormat { get; set; }
        public Vector3[] vertices { get; set; }
        public int[] triangles { get; set; }
        public BoneWeight[] boneWeights { get; set; }
        public Matrix4x4[] bindposes { get; set; }
        public int blendShapeCount => shapes.Count;
        public void AddBlendShapeFrame(string shapeName, float frameWeight, Vector3[] deltaVertices, Vector3[] deltaNormals, Vector3[] deltaTangents) {
            if (shapes.Contains(shapeName)) throw new ArgumentException(shapeName);
            shapes.Add(shapeName);
        }
        public void GetVertices(List<Vector3> vertices) { vertices.Clear(); vertices.AddRange(this.vertices); }
        public void RecalculateNormals() { }
        public void RecalculateBounds() { }
    }

    public enum CameraType { Game = 1 }

    [Flags]
    public enum DepthTextureMode { None = 0, Depth = 1 }

    public sealed class Camera : Behaviour {
        internal readonly List<CommandBuffer> added = new List<CommandBuffer>();
        public enum StereoscopicEye { Left, Right }
        public enum MonoOrStereoscopicEye { Left, Right, Mono }
        public delegate void CameraCallback(Camera cam);
        public static CameraCallback onPreCull;
        public static CameraCallback onPreRender;
        public static CameraCallback onPostRender;
        public bool orthographic { get; set; }
        public int cullingMask { get; set; }
        public CameraType cameraType { get; set; }
        public DepthTextureMode depthTextureMode { get; set; }
        public Rect pixelRect { get; set; }
        public int scaledPixelWidth => (int)pixelRect.width;
        public int scaledPixelHeight => (int)pixelRect.height;
        public RenderTexture targetTexture { get; set; }
        public RenderTexture activeTexture { get; internal set; }
        public Matrix4x4 worldToCameraMatrix { get; set; }
        public Matrix4x4 projectionMatrix { get; set; }
        public Matrix4x4 cullingMatrix { get; set; }
        public SceneManagement.Scene scene { get; set; }
        public bool stereoEnabled { get; internal set; }
        public MonoOrStereoscopicEye stereoActiveEye => MonoOrStereoscopicEye.Mono;
        internal readonly Matrix4x4[] stereoViews = new Matrix4x4[2];
        public Matrix4x4 GetStereoViewMatrix(StereoscopicEye eye) => stereoViews[(int)eye];
        public Matrix4x4 GetStereoProjectionMatrix(StereoscopicEye eye) => projectionMatrix;
        public void AddCommandBuffer(CameraEvent evt, CommandBuffer buffer) { added.Add(buffer); }
        public void RemoveCommandBuffer(CameraEvent evt, CommandBuffer buffer) { added.Remove(buffer); }
    }

    public static class GeometryUtility {
        internal static bool seen = true;
        internal static Plane[] last; // the planes that were written last
        internal static bool onlyLast; // whether only those see anything
        public static void CalculateFrustumPlanes(Matrix4x4 worldToProjectionMatrix, Plane[] planes) { last = planes; }
        public static bool TestPlanesAABB(Plane[] planes, Bounds bounds) => seen && (!onlyLast || planes == last);
    }

    public static class Gizmos {
        public static Color color { get; set; }
        public static void DrawCube(Vector3 center, Vector3 size) { }
    }

    namespace SceneManagement {
        public struct Scene {
            public bool IsValid() => false;
            public static bool operator ==(Scene lhs, Scene rhs) => true;
            public static bool operator !=(Scene lhs, Scene rhs) => false;
            public override bool Equals(object other) => other is Scene;
            public override int GetHashCode() => 0;
        }
    }
}
