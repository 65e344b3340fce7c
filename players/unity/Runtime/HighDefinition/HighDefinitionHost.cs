using UnityEngine;
using UnityEngine.Rendering;
using UnityEngine.Rendering.HighDefinition;

// Nothing refers to this assembly: without this a build would leave it out.
[assembly: UnityEngine.Scripting.AlwaysLinkAssembly]

namespace AvatarExport.HighDefinition {
    /// <summary>
    /// Draws avatars in the High Definition render pipeline: while it is in use, a hidden global volume holds a custom
    /// pass.
    /// </summary>
    internal static class HighDefinitionHost {
        private static GameObject holder;

        // Both attributes: one serves players and play mode, the other the scene view while nothing plays.
#if UNITY_EDITOR
        [UnityEditor.InitializeOnLoadMethod]
#endif
        [RuntimeInitializeOnLoadMethod(RuntimeInitializeLoadType.AfterAssembliesLoaded)]
        private static void Start() {
            RenderPipelineManager.beginCameraRendering -= Begin;
            RenderPipelineManager.beginCameraRendering += Begin;
#if UNITY_EDITOR
            // The volume would outlive its code, and a second one would draw the avatars twice.
            UnityEditor.AssemblyReloadEvents.beforeAssemblyReload += () => Objects.Destroy(holder);
#endif
        }

        private static void Begin(ScriptableRenderContext context, Camera camera) {
            if (holder != null || !(GraphicsSettings.currentRenderPipeline is HDRenderPipelineAsset)) return;
            if (AvatarScene.Shared.Sees(camera)) Make();
        }

        private static void Make() {
            holder = new GameObject("Gaussian avatars") { hideFlags = HideFlags.HideAndDontSave };
            var volume = holder.AddComponent<CustomPassVolume>();
            volume.isGlobal = true;
            volume.injectionPoint = CustomPassInjectionPoint.BeforePostProcess;
            volume.customPasses.Add(new AvatarCustomPass()); // AddPassOfType finds no constructor that a build stripped
        }
    }
}
