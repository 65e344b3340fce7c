// Stands in for the High Definition render pipeline in tests. Signatures are Unity's; bodies are ours.
namespace UnityEngine.Rendering.HighDefinition {
    public enum CustomPassInjectionPoint { BeforePostProcess = 2 }
    public class HDRenderPipelineAsset : RenderPipelineAsset { }
    public class HDCamera { public Camera camera; public int actualWidth => 0; public int actualHeight => 0; }

    public struct CustomPassContext {
        public readonly CommandBuffer cmd;
        public readonly HDCamera hdCamera;
        public readonly RTHandle cameraColorBuffer;
        internal CustomPassContext(CommandBuffer commands) {
            cmd = commands;
            hdCamera = null;
            cameraColorBuffer = null;
        }
    }

    public abstract class CustomPass { protected virtual void Execute(CustomPassContext ctx) { } }

    public class CustomPassVolume : MonoBehaviour {
        public CustomPassInjectionPoint injectionPoint;
        public bool isGlobal { get; set; }
        public System.Collections.Generic.List<CustomPass> customPasses = new System.Collections.Generic.List<CustomPass>();
    }
}
