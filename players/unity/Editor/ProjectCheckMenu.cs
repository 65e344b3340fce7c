using System.Collections.Generic;
using UnityEditor;
using UnityEngine;

namespace AvatarExport.Editor {
    /// <summary>Tools > Gaussian Avatar > Check Project, and the same findings as boxes of an inspector.</summary>
    public static class ProjectCheckMenu {
        /// <summary>Writes what does not suit avatars into the console, each with its remedy.</summary>
        [MenuItem("Tools/Gaussian Avatar/Check Project")]
        public static void Run() {
            List<Finding> findings = ProjectCheck.Of(ProjectSettings.Read());
            foreach (Finding finding in findings) {
                if (finding.Stops) Debug.LogError("Gaussian Avatar: " + finding);
                else Debug.LogWarning("Gaussian Avatar: " + finding);
            }
            if (findings.Count == 0) Debug.Log("Gaussian Avatar: the settings of this project suit avatars.");
        }

        /// <summary>Draws a box for each finding.</summary>
        internal static void DrawFindings() {
            foreach (Finding finding in ProjectCheck.Of(ProjectSettings.Read())) {
                EditorGUILayout.HelpBox(finding.ToString(), finding.Stops ? MessageType.Error : MessageType.Warning);
            }
        }
    }
}
