using AvatarExport.Core;
using UnityEditor;
using UnityEngine;

namespace AvatarExport.Editor {
    /// <summary>Tools > Gaussian Avatar > Conform: whether this machine's GPU computes what it should, stage by stage.</summary>
    public static class ConformMenu {
        /// <summary>Asks for a folder NAME.reference and writes the table of its stages into the console.</summary>
        [MenuItem("Tools/Gaussian Avatar/Conform...")]
        public static void Run() {
            string folder = EditorUtility.OpenFolderPanel("Choose NAME.reference", "", "");
            if (folder.Length == 0) return;
            try {
                using (var runner = new GpuStageRunner()) {
                    ConformReport report = ConformFolder.Run(folder, runner);
                    string text = $"Gaussian Avatar: {SystemInfo.graphicsDeviceName}, {SystemInfo.graphicsDeviceType}\n" + ConformFolder.Table(report);
                    if (report.Passed) Debug.Log(text);
                    else Debug.LogError(text);
                }
            } catch (AvatarError error) {
                Debug.LogError("Gaussian Avatar: " + error.Message);
            }
        }
    }
}
