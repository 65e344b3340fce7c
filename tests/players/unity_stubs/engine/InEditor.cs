// Stands in for Unity in tests: what the runtime asks of the editor. Signatures are Unity's; bodies are ours.
using System;

namespace UnityEditor {
    public class InitializeOnLoadMethodAttribute : Attribute { }

    public static class AssemblyReloadEvents {
        public delegate void AssemblyReloadCallback();
        public static event AssemblyReloadCallback beforeAssemblyReload { add { } remove { } }
    }

    namespace SceneManagement {
        public sealed class EditorSceneManager {
            public static bool IsPreviewSceneObject(UnityEngine.Object obj) => false;
        }
    }
}
