// Members of Unity's own classes that only the Editor assembly, its tests, the samples and the pages' examples use; the rest is in
// the folder engine. Signatures are Unity's; bodies are ours.
using System;
using System.Collections.Generic;
using System.Linq;

namespace UnityEngine {
    public partial class Object {
        public static T Instantiate<T>(T original, Transform parent) where T : Object => original;
    }

    public partial class Component {
        public Component GetComponent(Type type) => holder.components.FirstOrDefault(type.IsInstanceOfType);
    }

    public partial class ScriptableObject {
        public static T CreateInstance<T>() where T : ScriptableObject => (T)Activator.CreateInstance(typeof(T));
    }

    public sealed partial class GameObject {
        public T GetComponent<T>() => components.OfType<T>().FirstOrDefault();
    }

    public partial class Transform {
        public Transform Find(string n) {
            string first = n.Split('/')[0];
            Transform child = children.FirstOrDefault(one => one.gameObject.name == first);
            return child == null || first == n ? child : child.Find(n.Substring(first.Length + 1));
        }
    }

    public sealed partial class Mesh { public string GetBlendShapeName(int shapeIndex) => shapes[shapeIndex]; }

    public sealed partial class Texture2D {
        internal byte[] raw;
        public Texture2D(int width, int height, TextureFormat textureFormat, bool mipChain) : this(width, height, textureFormat, mipChain, false) { }
        public void LoadRawTextureData(byte[] data) { raw = data; }
        public void Apply() { }
    }

    public struct Vector2 {
        public float x;
        public float y;
        public Vector2(float x, float y) { this.x = x; this.y = y; }
    }

    public partial struct Rect {
        public bool Contains(Vector2 point) {
            return point.x >= x && point.x < x + width && point.y >= y && point.y < y + height;
        }
    }

    public enum EventType { Repaint = 7, DragUpdated = 9, DragPerform = 10, Used = 12 }

    public sealed class Event {
        public static Event current { get; internal set; } = new Event { type = EventType.Repaint };
        public EventType type { get; set; }
        public Vector2 mousePosition { get; set; }
        public void Use() { type = EventType.Used; }
    }

    public enum AnimatorCullingMode { AlwaysAnimate = 0, CullUpdateTransforms = 1 }

    public class Animator : Behaviour {
        private AnimatorCullingMode culling = AnimatorCullingMode.CullUpdateTransforms;
        public AnimatorCullingMode cullingMode { get { return culling; } set { culling = value; } }
    }

    public static partial class SystemInfo { public static string graphicsDeviceName => "stub"; }

    public static partial class Resources {
        internal static readonly List<Object> Loaded = new List<Object>();
        public static T[] FindObjectsOfTypeAll<T>() => Loaded.OfType<T>().ToArray();
    }

    public static partial class Debug {
        public static void Log(object message) { Told.Add("log: " + message); }
        public static void LogWarning(object message) { Told.Add("warning: " + message); }
        public static void LogError(object message) { Told.Add("error: " + message); }
    }

    public static partial class Time { public static float time => 0; }

    public partial struct Mathf {
        public static int Clamp(int value, int min, int max) => Math.Min(Math.Max(value, min), max);
        public static float Min(float a, float b) => Math.Min(a, b);
        public static float PingPong(float t, float length) => t;
    }

    public partial struct Quaternion { public static Quaternion Euler(float x, float y, float z) => identity; }
    public class GUIStyle { }
    public class GUISkin : ScriptableObject { public GUIStyle box { get; set; } }
    public sealed class GUILayoutOption { }

    public class GUI {
        private static bool on = true;
        public static bool enabled { get { return on; } set { on = value; } }
        public static GUISkin skin => new GUISkin();
    }

    public class GUILayout {
        public static bool Button(string text, params GUILayoutOption[] options) => false;
        public static void Label(string text, params GUILayoutOption[] options) { }
        public static float HorizontalSlider(float value, float leftValue, float rightValue, params GUILayoutOption[] options) => value;
        public static void BeginArea(Rect screenRect, GUIStyle style) { }
        public static void EndArea() { }
        public static void BeginHorizontal(params GUILayoutOption[] options) { }
        public static void EndHorizontal() { }
        public static Vector2 BeginScrollView(Vector2 scrollPosition, params GUILayoutOption[] options) => scrollPosition;
        public static void EndScrollView() { }
        public static GUILayoutOption Width(float width) => new GUILayoutOption();
    }
}
