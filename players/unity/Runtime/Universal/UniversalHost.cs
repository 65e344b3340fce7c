using UnityEngine;
using UnityEngine.Rendering;
using UnityEngine.Rendering.Universal;

// Nothing refers to this assembly: without this a build would leave it out.
[assembly: UnityEngine.Scripting.AlwaysLinkAssembly]

namespace AvatarExport.Universal {
    /// <summary>
    /// Draws avatars in the Universal render pipeline: it hands each camera that sees one a pass. Nothing is added to a
    /// renderer asset, so nothing can be forgotten.
    /// </summary>
    internal static class UniversalHost {
        private static AvatarPass pass;

        // Both attributes: one serves players and play mode, the other the scene view while nothing plays.
#if UNITY_EDITOR
        [UnityEditor.InitializeOnLoadMethod]
#endif
        [RuntimeInitializeOnLoadMethod(RuntimeInitializeLoadType.AfterAssembliesLoaded)]
        private static void Start() {
            RenderPipelineManager.beginCameraRendering -= Begin;
            RenderPipelineManager.beginCameraRendering += Begin;
        }

        private static void Begin(ScriptableRenderContext context, Camera camera) {
            var pipeline = GraphicsSettings.currentRenderPipeline as UniversalRenderPipelineAsset;
            if (pipeline == null || !AvatarScene.Shared.Sees(camera)) return;
            if (pass == null) pass = new AvatarPass();
            UniversalAdditionalCameraData data;
            bool has = camera.TryGetComponent(out data);
            ScriptableRenderer renderer = has ? data.scriptableRenderer : pipeline.scriptableRenderer;
            renderer.EnqueuePass(pass);
        }
    }
}
