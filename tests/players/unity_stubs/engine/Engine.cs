// Stands in for Unity in tests: attributes, time, files. Signatures are Unity's; bodies are ours.
using System;
using System.Collections.Generic;
using System.Runtime.CompilerServices;

[assembly: InternalsVisibleTo("AvatarExport.Tests.Runtime")]

namespace UnityEngine {
    public sealed class SerializeField : Attribute { }
    public sealed class HideInInspector : Attribute { }
    public sealed class ExecuteAlways : Attribute { }
    public class DefaultExecutionOrder : Attribute { public DefaultExecutionOrder(int order) { } }
    public sealed class DisallowMultipleComponent : Attribute { }
    public sealed class PreferBinarySerialization : Attribute { }
    public sealed class TooltipAttribute : Attribute { public TooltipAttribute(string tooltip) { } }
    public sealed class AddComponentMenu : Attribute { public AddComponentMenu(string menuName) { } }
    public enum RuntimeInitializeLoadType { AfterAssembliesLoaded = 2 }

    public sealed class RuntimeInitializeOnLoadMethodAttribute : Attribute {
        public RuntimeInitializeOnLoadMethodAttribute(RuntimeInitializeLoadType loadType) { }
    }

    namespace Scripting {
        [AttributeUsage(AttributeTargets.Assembly, AllowMultiple = true)] // tests compile assemblies together
        public class AlwaysLinkAssemblyAttribute : Attribute { }
    }

    public static class Application {
        internal static bool playing = true;
        public static bool isPlaying => playing;
        public static string streamingAssetsPath => "/streaming";
    }

    public static partial class Time {
        public static float deltaTime => 0.02f;
        public static float realtimeSinceStartup => 0;
    }

    public static partial class Debug {
        internal static readonly List<string> Told = new List<string>();
        public static void LogWarning(object message, Object context) { Told.Add("warning: " + message); }
        public static void LogError(object message, Object context) { Told.Add("error: " + message); }
    }

    public static partial class Resources {
        public static T Load<T>(string path) where T : Object {
            var made = (T)Activator.CreateInstance(typeof(T));
            made.name = path.Substring(path.LastIndexOf('/') + 1);
            return made;
        }
    }

    public class AsyncOperation {
        /// <summary>It is completed when somebody asks.</summary>
        public event Action<AsyncOperation> completed { add { value(this); } remove { } }
    }

    namespace Networking {
        public class UnityWebRequestAsyncOperation : AsyncOperation { }
        public class DownloadHandler { public byte[] data => UnityWebRequest.answer; }

        public class UnityWebRequest : IDisposable {
            public enum Result { InProgress, Success }

            internal static byte[] answer; // null: an error
            internal static string asked;
            public static UnityWebRequest Get(string uri) { asked = uri; return new UnityWebRequest(); }
            public Result result => answer == null ? Result.InProgress : Result.Success;
            public string error => answer == null ? "404 Not Found" : null;
            public DownloadHandler downloadHandler => new DownloadHandler();
            public UnityWebRequestAsyncOperation SendWebRequest() {
                if (asked.StartsWith("http:")) throw new InvalidOperationException("Insecure connection not allowed");
                return new UnityWebRequestAsyncOperation();
            }
            public void Dispose() { }
        }
    }

    namespace XR {
        public static class XRSettings {
            public enum StereoRenderingMode { MultiPass, SinglePass, SinglePassInstanced, SinglePassMultiview }

            public static StereoRenderingMode stereoRenderingMode => StereoRenderingMode.SinglePassInstanced;
        }
    }
}
