using System.Collections.Generic;
using UnityEngine.Rendering;

namespace AvatarExport.Editor {
    /// <summary>Which package draws the project.</summary>
    public enum Pipeline {
        BuiltIn,
        Universal,
        HighDefinition,
        Other,
    }

    /// <summary>The settings of a project that avatars depend on.</summary>
    public struct ProjectFacts {
        /// <summary>Name of the platform that is built for.</summary>
        public string Platform;

        /// <summary>Graphics APIs of that platform, the first choice first.</summary>
        public GraphicsDeviceType[] Apis;

        /// <summary>What the Editor itself draws with, and whether it has compute shaders.</summary>
        public GraphicsDeviceType EditorApi;

        /// <summary>Whether the Editor's graphics API has compute shaders.</summary>
        public bool EditorHasCompute;

        /// <summary>The active render pipeline.</summary>
        public Pipeline Pipeline;

        /// <summary>HDRP: whether custom passes are on. Else true.</summary>
        public bool CustomPasses;

        /// <summary>Whether the Player settings clamp blend shapes to 0..100.</summary>
        public bool ClampsBlendShapes;
    }

    /// <summary>A setting with which avatars are not shown, or not shown rightly.</summary>
    public struct Finding {
        /// <summary>Whether splats cannot be drawn at all.</summary>
        public bool Stops;

        /// <summary>What is wrong.</summary>
        public string What;

        /// <summary>Where it is changed: the menu, the setting, the value.</summary>
        public string Remedy;

        /// <summary>Both as one line.</summary>
        public override string ToString() => What + " " + Remedy;
    }

    /// <summary>Which settings of a project do not suit avatars. The facts are gathered by ProjectSettings.</summary>
    public static class ProjectCheck {
        private const string Apis = "Edit > Project Settings > Player > Other Settings > Auto Graphics API (for Windows, Mac, Linux: its own switch): off; then ";

        /// <summary>All that is wrong, the worst first; empty if nothing is.</summary>
        public static List<Finding> Of(ProjectFacts facts) {
            var findings = new List<Finding>();
            if (!facts.EditorHasCompute) {
                Add(findings, true, $"The Editor runs on {facts.EditorApi}, which has no compute shaders here: it shows the mesh.",
                    Apis + "put Direct3D11, Vulkan or Metal first, and restart the Editor.");
            }
            if (facts.Pipeline == Pipeline.Other) {
                Add(findings, true, "The render pipeline is neither Built-in nor Universal nor High Definition: it shows the mesh.",
                    "Edit > Project Settings > Graphics: choose a pipeline asset of URP or HDRP, or none.");
            }
            if (facts.Pipeline == Pipeline.HighDefinition && !facts.CustomPasses) {
                Add(findings, true, "HDRP draws no avatar while its custom passes are off.",
                    "Select the HDRP asset; Inspector > Rendering > Custom Pass: on.");
            }
            foreach (GraphicsDeviceType api in facts.Apis) AddApi(findings, facts.Platform, api);
            if (facts.ClampsBlendShapes) {
                Add(findings, false, "Blend shapes are clamped to 0..100: expressions below 0 or above 1 are cut.",
                    "Edit > Project Settings > Player > Other Settings > Legacy > Clamp BlendShapes (Deprecated): off.");
            }
            return findings;
        }

        private static void AddApi(List<Finding> findings, string platform, GraphicsDeviceType api) {
            // Names, since newer releases call some members obsolete.
            string name = api.ToString();
            if (name == "OpenGLES2") {
                Add(findings, true, $"{platform} may run on OpenGL ES 2, which has no compute shaders: it shows the mesh.",
                    Apis + "remove OpenGLES2 and add Vulkan.");
            } else if (name == "OpenGLES3" && platform == "WebGL") {
                Add(findings, true, "WebGL 2 has no compute shaders: it shows the mesh.",
                    Apis + "put WebGPU first, where your release has it; or use the web player of avatar-export.");
            } else if (name == "OpenGLES3") {
                Add(findings, false, $"{platform} may run on OpenGL ES 3. Devices with 3.0 have no compute shaders: they show the mesh.",
                    Apis + "put Vulkan first; Require ES3.1: on, if the mesh will not do.");
            } else if (name == "OpenGLCore" && platform == "StandaloneOSX") {
                Add(findings, true, "OpenGL on macOS has no compute shaders: it shows the mesh.", Apis + "put Metal first.");
            } else if (name == "Null") {
                Add(findings, true, $"{platform} has no graphics API: nothing is drawn.", "Start without -nographics.");
            }
        }

        private static void Add(List<Finding> findings, bool stops, string what, string remedy) {
            int at = stops ? findings.FindIndex(one => !one.Stops) : -1;
            findings.Insert(at < 0 ? findings.Count : at, new Finding { Stops = stops, What = what, Remedy = remedy });
        }
    }
}
