// Stubs of the part of UnityEditor that the package's Editor assembly uses, for compiling and for tests without Unity.
// Signatures as in Unity's public C# reference, release 2022.3.9f1; the behaviour is this project's own and minimal.
using System;
using System.Collections.Generic;
using UnityEngine;
using UnityEngine.Rendering;
using Object = UnityEngine.Object;

namespace UnityEditor {
    public enum BuildTarget { StandaloneWindows64 = 19 }
    public enum MessageType { None, Info, Warning, Error }

    [AttributeUsage(AttributeTargets.Method)]
    public sealed class MenuItem : Attribute { public MenuItem(string itemName) { } }

    [AttributeUsage(AttributeTargets.Class)]
    public class CustomEditor : Attribute { public CustomEditor(Type inspectedType) { } }

    public class Editor : ScriptableObject {
        public Object target { get; set; }
        public SerializedObject serializedObject => new SerializedObject(target);
        public virtual void OnInspectorGUI() { }
        protected internal static void DrawPropertiesExcluding(SerializedObject obj, params string[] propertyToExclude) { }
    }

    public class SerializedObject {
        private readonly Object target;
        public SerializedObject(Object obj) { target = obj; }
        public SerializedProperty FindProperty(string propertyPath) => SerializedProperty.Of(target, propertyPath);
        public bool ApplyModifiedProperties() => false;
        public void Update() { }
    }

    /// <summary>Fields of plain objects, by reflection.</summary>
    public class SerializedProperty {
        private object value, holder;
        private System.Reflection.FieldInfo place;
        public Object objectReferenceValue {
            get => (Object)value;
            set {
                this.value = value;
                place.SetValue(holder, value);
            }
        }
        public bool boolValue { get { return (bool)value; } set { this.value = value; } }
        public int intValue { get { return (int)value; } set { this.value = value; } }
        public string stringValue { get { return (string)value; } set { this.value = value; } }

        internal static SerializedProperty Of(object owner, string path) {
            const System.Reflection.BindingFlags Any = System.Reflection.BindingFlags.Instance
                | System.Reflection.BindingFlags.Public | System.Reflection.BindingFlags.NonPublic;
            var found = new SerializedProperty { value = owner };
            foreach (string name in path.Split('.')) {
                System.Reflection.FieldInfo field = found.value.GetType().GetField(name, Any);
                if (field == null) return null;
                found = new SerializedProperty { holder = found.value, place = field, value = field.GetValue(found.value) };
            }
            return found;
        }
    }

    public sealed class EditorGUILayout {
        /// <summary>What was drawn last, for tests.</summary>
        internal static readonly List<string> Drawn = new List<string>();

        public static void HelpBox(string message, MessageType type) { Drawn.Add(type + ": " + message); }
        public static void LabelField(string label, params GUILayoutOption[] options) { Drawn.Add(label); }
        public static void LabelField(string label, GUIStyle style, params GUILayoutOption[] options) { Drawn.Add(label); }
        public static void LabelField(string label, string label2, params GUILayoutOption[] options) { Drawn.Add(label + ": " + label2); }
        public static void LabelField(string label, string label2, GUIStyle style, params GUILayoutOption[] options) { Drawn.Add(label + ": " + label2); }
        public static float Slider(string label, float value, float leftValue, float rightValue, params GUILayoutOption[] options) {
            Drawn.Add("slider " + label);
            return value;
        }
        public static bool Foldout(bool foldout, string content, bool toggleOnLabelClick) { Drawn.Add("foldout " + content); return foldout; }
        public static string TextField(string label, string text, params GUILayoutOption[] options) => text;
        public static int Popup(string label, int selectedIndex, string[] displayedOptions, params GUILayoutOption[] options) => selectedIndex;
        public static void Space() { }
        public static Rect GetControlRect(params GUILayoutOption[] options) => new Rect(10, 20, 200, 18);
    }

    public enum DragAndDropVisualMode { None = 0, Link = 2 }

    public class DragAndDrop {
        public static Object[] objectReferences { get; set; }
        public static DragAndDropVisualMode visualMode { get; set; }
        public static void AcceptDrag() { }
    }

    public static class EditorStyles {
        public static GUIStyle boldLabel => new GUIStyle();
        public static GUIStyle wordWrappedLabel => new GUIStyle();
    }

    public sealed class EditorGUI {
        public static bool PropertyField(Rect position, SerializedProperty property) => false;
        public static void BeginChangeCheck() { }
        public static bool EndChangeCheck() => false;
    }

    public class Undo {
        public static void RecordObject(Object objectToUndo, string name) { }
        public static void RegisterFullObjectHierarchyUndo(Object objectToUndo, string name) { }
    }

    public class PrefabUtility {
        public static void RecordPrefabInstancePropertyModifications(Object targetObject) { }
    }

    public class EditorUtility {
        internal static readonly List<Object> Persistent = new List<Object>();
        public static void SetDirty(Object target) { }
        public static bool IsPersistent(Object target) => Persistent.Contains(target);
        public static string OpenFolderPanel(string title, string folder, string defaultName) => "";
    }

    public sealed class EditorApplication { public static void QueuePlayerLoopUpdate() { } }

    public sealed class AssetDatabase {
        public static string GetAssetPath(Object assetObject) => assetObject.name + ".avatar";
        public static T LoadAssetAtPath<T>(string assetPath) where T : Object => null;
    }

    public sealed class PlayerSettings {
        public static bool legacyClampBlendShapeWeights { get; set; }
        public static GraphicsDeviceType[] GetGraphicsAPIs(BuildTarget platform) { return new[] { GraphicsDeviceType.Direct3D11 }; }
    }

    public class EditorUserBuildSettings {
        public static BuildTarget activeBuildTarget => BuildTarget.StandaloneWindows64;
    }

    public class AssetPostprocessor { }
    public class AssetImporter : Object { public string assetPath { get; set; } }
}

namespace UnityEditor.AssetImporters {
    [AttributeUsage(AttributeTargets.Class)]
    public class ScriptedImporterAttribute : Attribute {
        public ScriptedImporterAttribute(int version, string ext) { }
    }

    public abstract class ScriptedImporter : AssetImporter {
        public abstract void OnImportAsset(AssetImportContext ctx);
    }

    public abstract class AssetImporterEditor : Editor { protected virtual bool needsApplyRevert => true; }
    public class ScriptedImporterEditor : AssetImporterEditor { }

    /// <summary>Keeps what an importer hands over.</summary>
    public class AssetImportContext {
        public string assetPath { get; set; }
        public Object mainObject { get; private set; }
        internal readonly Dictionary<string, Object> Objects = new Dictionary<string, Object>();
        internal readonly Dictionary<string, Texture2D> Thumbnails = new Dictionary<string, Texture2D>();
        internal readonly List<string> Errors = new List<string>();
        public void AddObjectToAsset(string identifier, Object obj) { Objects.Add(identifier, obj); }
        public void AddObjectToAsset(string identifier, Object obj, Texture2D thumbnail) {
            Objects.Add(identifier, obj);
            Thumbnails.Add(identifier, thumbnail);
        }
        public void SetMainObject(Object obj) { mainObject = obj; }
        public void LogImportError(string msg, Object obj = null) { Errors.Add(msg); }
    }
}
