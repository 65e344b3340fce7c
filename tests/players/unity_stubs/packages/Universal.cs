// Stands in for the Universal render pipeline in tests. Signatures are Unity's; bodies are ours.
using System;

namespace UnityEngine.Rendering.Universal {
    public enum RenderPassEvent { BeforeRenderingPostProcessing = 550 }

    [Flags]
    public enum ScriptableRenderPassInput { None = 0, Depth = 1 }

    public abstract class ScriptableRenderer {
        public RTHandle cameraColorTargetHandle => null;
        public RTHandle cameraDepthTargetHandle => null;
        public void EnqueuePass(ScriptableRenderPass pass) { }
    }

    public class UniversalRenderPipelineAsset : RenderPipelineAsset {
        public ScriptableRenderer scriptableRenderer => null;
    }

    public class UniversalAdditionalCameraData : MonoBehaviour {
        public ScriptableRenderer scriptableRenderer => null;
    }

    public abstract class ScriptableRenderPass {
        public RenderPassEvent renderPassEvent { get; set; }
        public void ConfigureInput(ScriptableRenderPassInput passInput) { }
#if UNITY_6000_0_OR_NEWER
        public virtual void RecordRenderGraph(RenderGraphModule.RenderGraph renderGraph, ContextContainer frameData) { }
#if !UNITY_6000_3_OR_NEWER
        [Obsolete]
        public virtual void Execute(ScriptableRenderContext context, ref RenderingData renderingData) { }
#endif
#else
        public abstract void Execute(ScriptableRenderContext context, ref RenderingData renderingData);
#endif
    }

    public struct CameraData {
        public Camera camera => null;
        public ScriptableRenderer renderer => null;
        public RenderTextureDescriptor cameraTargetDescriptor => new RenderTextureDescriptor();
        public Matrix4x4 GetViewMatrix(int viewIndex = 0) => new Matrix4x4();
        public Matrix4x4 GetProjectionMatrix(int viewIndex = 0) => new Matrix4x4();
        public bool IsRenderTargetProjectionMatrixFlipped(RTHandle color, RTHandle depth = null) => true;
    }

    public struct RenderingData { public CameraData cameraData; }

#if UNITY_6000_0_OR_NEWER
    public class UniversalCameraData {
        public Camera camera;
        public RenderTextureDescriptor cameraTargetDescriptor;
        public Matrix4x4 GetViewMatrix(int viewIndex = 0) => new Matrix4x4();
        public Matrix4x4 GetProjectionMatrix(int viewIndex = 0) => new Matrix4x4();
        public bool IsRenderTargetProjectionMatrixFlipped(RTHandle color, RTHandle depth = null) => true;
    }

    public class UniversalResourceData {
        public RenderGraphModule.TextureHandle activeColorTexture => new RenderGraphModule.TextureHandle();
        public RenderGraphModule.TextureHandle cameraDepthTexture => new RenderGraphModule.TextureHandle();
    }
#endif
}
