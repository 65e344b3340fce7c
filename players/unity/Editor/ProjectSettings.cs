using UnityEditor;
using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport.Editor {
    /// <summary>Gathers the facts for ProjectCheck from the open project.</summary>
    public static class ProjectSettings {
        // Serialized fields of HDRenderPipelineAsset. Read by name, so that the package needs no HDRP.
        private const string CustomPass = "m_RenderPipelineSettings.supportCustomPass";

        /// <summary>The facts as they are now.</summary>
        public static ProjectFacts Read() {
            BuildTarget platform = EditorUserBuildSettings.activeBuildTarget;
            RenderPipelineAsset asset = GraphicsSettings.currentRenderPipeline;
            Pipeline pipeline = PipelineOf(asset);
            return new ProjectFacts {
                Platform = platform.ToString(),
                Apis = PlayerSettings.GetGraphicsAPIs(platform),
                EditorApi = SystemInfo.graphicsDeviceType,
                EditorHasCompute = SystemInfo.supportsComputeShaders,
                Pipeline = pipeline,
                CustomPasses = pipeline != Pipeline.HighDefinition || IsOn(asset, CustomPass),
                ClampsBlendShapes = PlayerSettings.legacyClampBlendShapeWeights,
            };
        }

        private static Pipeline PipelineOf(RenderPipelineAsset asset) {
            if (asset == null) return Pipeline.BuiltIn;
            switch (asset.GetType().Name) {
                case "UniversalRenderPipelineAsset":
                    return Pipeline.Universal;
                case "HDRenderPipelineAsset":
                    return Pipeline.HighDefinition;
                default:
                    return Pipeline.Other;
            }
        }

        /// <summary>A serialized bool; true where a release has no such field, since nothing is known to be wrong then.</summary>
        private static bool IsOn(Object asset, string path) {
            SerializedProperty property = new SerializedObject(asset).FindProperty(path);
            return property == null || property.boolValue;
        }
    }
}
