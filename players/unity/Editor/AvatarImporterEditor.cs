using System.Collections.Generic;
using AvatarExport.Core;
using UnityEditor;
using UnityEditor.AssetImporters;

namespace AvatarExport.Editor {
    /// <summary>The inspector of a file NAME.avatar: what is in it, its terms, and what of the project does not suit it.</summary>
    [CustomEditor(typeof(AvatarImporter))]
    public sealed class AvatarImporterEditor : ScriptedImporterEditor {
        private bool showsRanges;

        /// <summary>There is nothing to apply: the importer has no settings.</summary>
        protected override bool needsApplyRevert => false;

        /// <summary>Called by Unity to draw.</summary>
        public override void OnInspectorGUI() {
            string path = ((AvatarImporter)target).assetPath;
            GaussianAvatarAsset asset = AssetDatabase.LoadAssetAtPath<GaussianAvatarAsset>(path);
            if (asset != null) Draw(asset);
        }

        /// <summary>Draws what an asset says of itself.</summary>
        internal void Draw(GaussianAvatarAsset asset) {
            LoadedAvatar avatar;
            try {
                avatar = asset.Load();
            } catch (AvatarError error) {
                EditorGUILayout.HelpBox(error.Message, MessageType.Error);
                return;
            }
            foreach (KeyValuePair<string, string> row in AvatarFacts.Of(avatar)) {
                EditorGUILayout.LabelField(row.Key, row.Value, EditorStyles.wordWrappedLabel);
            }
            EditorGUILayout.Space();
            EditorGUILayout.LabelField("Clips", EditorStyles.boldLabel);
            foreach (string line in AvatarFacts.Clips(avatar)) EditorGUILayout.LabelField(line);
            showsRanges = EditorGUILayout.Foldout(showsRanges, "Trained ranges", true);
            if (showsRanges) {
                foreach (string line in AvatarFacts.Ranges(avatar)) EditorGUILayout.LabelField(line);
            }
            EditorGUILayout.Space();
            ProjectCheckMenu.DrawFindings();
        }
    }
}
