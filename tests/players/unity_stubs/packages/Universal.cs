// Stands in for the Universal render pipeline in tests. Signatures are Unity's; bodies are ours.
using System;

namespace UnityEngine.Rendering.Universal
{
    public enum RenderPassEvent { BeforeRenderingPostProcessing = 550 }

    [Flags]
    public enum ScriptableRenderPassInput { None = 0, Depth = 1 }

    public abstract class ScriptableRenderer
    {
        public RTHandle cameraColorTargetHandle { get { return null; } }
        public RTHandle cameraDepthTargetHandle { get { return null; } }
        public void EnqueuePass(ScriptableRenderPass pass) { }
    }

    public class UniversalRenderPipelineAsset : RenderPipelineAsset
    {
        public ScriptableRenderer scriptableRenderer { get { return null; } }
    }

    public class UniversalAdditionalCameraData : MonoBehaviour
    {
        public ScriptableRenderer scriptableRenderer { get { return null; } }
    }

    public abstract class ScriptableRenderPass
    {
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

    public struct CameraData
    {
        public Camera camera { get { return null; } }
        public ScriptableRenderer renderer { get { return null; } }
        public RenderTextureDescriptor cameraTargetDescriptor { get { return new RenderTextureDescriptor(); } }
        public Matrix4x4 GetViewMatrix(int viewIndex = 0) { return new Matrix4x4(); }
        public Matrix4x4 GetProjectionMatrix(int viewIndex = 0) { return new Matrix4x4(); }
        public bool IsRenderTargetProjectionMatrixFlipped(RTHandle color, RTHandle depth = null) { return true; }
    }

    public struct RenderingData
    {
        public CameraData cameraData;
    }

#if UNITY_6000_0_OR_NEWER
    public class UniversalCameraData
    {
        public Camera camera;
        public RenderTextureDescriptor cameraTargetDescriptor;
        public Matrix4x4 GetViewMatrix(int viewIndex = 0) { return new Matrix4x4(); }
        public Matrix4x4 GetProjectionMatrix(int viewIndex = 0) { return new Matrix4x4(); }
        public bool IsRenderTargetProjectionMatrixFlipped(RTHandle color, RTHandle depth = null) { return true; }
    }

    public class UniversalResourceData
    {
        public RenderGraphModule.TextureHandle activeColorTexture { get { return new RenderGraphModule.TextureHandle(); } }
        public RenderGraphModule.TextureHandle cameraDepthTexture { get { return new RenderGraphModule.TextureHandle(); } }
    }
#endif
}
