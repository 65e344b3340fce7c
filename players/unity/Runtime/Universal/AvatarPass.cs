using UnityEngine;
using UnityEngine.Rendering;
using UnityEngine.Rendering.Universal;
#if UNITY_6000_0_OR_NEWER
using UnityEngine.Rendering.RenderGraphModule;
#endif

namespace AvatarExport.Universal {
    /// <summary>
    /// The avatars of a camera: after the transparent objects, before post-processing. It asks for the depth texture.
    /// </summary>
    internal sealed class AvatarPass : ScriptableRenderPass {
        private const string Name = "Gaussian avatars";

        private readonly AvatarView view = new AvatarView();

        public AvatarPass() {
            renderPassEvent = RenderPassEvent.BeforeRenderingPostProcessing;
            ConfigureInput(ScriptableRenderPassInput.Depth);
        }

#if UNITY_6000_0_OR_NEWER
        private static readonly BaseRenderFunc<PassData, UnsafeGraphContext> Draw = DrawGraph;

        /// <summary>The render graph's path.</summary>
        public override void RecordRenderGraph(RenderGraph renderGraph, ContextContainer frameData) {
            var resources = frameData.Get<UniversalResourceData>();
            PassData data;
            using (IUnsafeRenderGraphBuilder builder = renderGraph.AddUnsafePass<PassData>(Name, out data)) {
                data.View = view;
                data.Camera = frameData.Get<UniversalCameraData>();
                data.Color = resources.activeColorTexture;
                builder.UseTexture(data.Color, AccessFlags.ReadWrite);
                TextureHandle depth = resources.cameraDepthTexture;
                data.HasDepth = depth.IsValid();
                if (data.HasDepth) builder.UseTexture(depth, AccessFlags.Read);
                builder.AllowPassCulling(false);
                builder.AllowGlobalStateModification(true); // the accumulated image is a global texture
                builder.SetRenderFunc(Draw);
            }
        }

        private static void DrawGraph(PassData data, UnsafeGraphContext context) {
            UniversalCameraData camera = data.Camera;
            RTHandle color = data.Color;
            bool bottomFirst = camera.IsRenderTargetProjectionMatrixFlipped(color);
            Fill(data.View, camera.camera, camera.cameraTargetDescriptor, color, bottomFirst);
            for (int eye = 0; eye < data.View.Eyes; eye++) {
                data.View.View[eye] = camera.GetViewMatrix(eye);
                data.View.Projection[eye] = camera.GetProjectionMatrix(eye);
            }
            data.View.HasDepth = data.HasDepth;
            AvatarScene.Shared.Record(CommandBufferHelpers.GetNativeCommandBuffer(context.cmd), data.View);
        }

        private sealed class PassData {
            public AvatarView View;
            public UniversalCameraData Camera;
            public TextureHandle Color;
            public bool HasDepth;
        }
#endif

#if !UNITY_6000_3_OR_NEWER || URP_COMPATIBILITY_MODE
        /// <summary>The path without a render graph.</summary>
#if UNITY_6000_0_OR_NEWER
        [System.Obsolete] // as what it overrides
#endif
        public override void Execute(ScriptableRenderContext context, ref RenderingData renderingData) {
            CommandBuffer commands = CommandBufferPool.Get(Name);
            ScriptableRenderer renderer = renderingData.cameraData.renderer;
            RTHandle color = renderer.cameraColorTargetHandle;
            bool bottomFirst = renderingData.cameraData.IsRenderTargetProjectionMatrixFlipped(color);
            Fill(view, renderingData.cameraData.camera, renderingData.cameraData.cameraTargetDescriptor, color,
                bottomFirst);
            for (int eye = 0; eye < view.Eyes; eye++) {
                view.View[eye] = renderingData.cameraData.GetViewMatrix(eye);
                view.Projection[eye] = renderingData.cameraData.GetProjectionMatrix(eye);
            }
            view.HasDepth = true;
            AvatarScene.Shared.Record(commands, view);
            // Passes that follow expect the targets that the pipeline set, and the pipeline sets them once.
            commands.SetRenderTarget(color.nameID, renderer.cameraDepthTargetHandle.nameID, 0, CubemapFace.Unknown, -1);
            context.ExecuteCommandBuffer(commands);
            CommandBufferPool.Release(commands);
        }
#endif

        private static void Fill(AvatarView view, Camera camera, RenderTextureDescriptor target, RTHandle color,
            bool bottomFirst) {
            bool isArray = target.dimension == TextureDimension.Tex2DArray;
            float scaleX = target.useDynamicScale ? ScalableBufferManager.widthScaleFactor : 1;
            float scaleY = target.useDynamicScale ? ScalableBufferManager.heightScaleFactor : 1;
            view.Camera = camera;
            view.Eyes = isArray ? Mathf.Min(target.volumeDepth, 2) : 1;
            view.IsArray = isArray;
            view.Fill(color.nameID, Mathf.CeilToInt(target.width * scaleX), Mathf.CeilToInt(target.height * scaleY));
            view.TopRowFirst = bottomFirst ? 0 : 1;
            // OpenGL says of no target that it begins with the bottom row: images of the pipeline have a texture.
            if (color.rt == null && !isArray) PlaceOnScreen(view, camera);
        }

        /// <summary>Without an image of its own a camera draws into its part of the screen.</summary>
        private static void PlaceOnScreen(AvatarView view, Camera camera) {
            Rect part = camera.pixelRect;
            view.Viewport = new Rect(part.x, part.y, view.Width, view.Height);
            view.TargetRows = Screen.height;
        }
    }
}
