using System.Collections.Generic;
using UnityEditor;
using UnityEngine;

namespace AvatarExport.Editor {
    /// <summary>
    /// The field Asset of the component. Unity's own refuses what a person drags there first: NAME.avatar itself, which is a prefab.
    /// </summary>
    internal static class AssetField {
        /// <summary>Draws the field "asset", which holds a GaussianAvatarAsset.</summary>
        public static void Draw(SerializedProperty asset) {
            Rect place = EditorGUILayout.GetControlRect();
            TakePrefab(place, asset);
            EditorGUI.PropertyField(place, asset);
        }

        private static void TakePrefab(Rect place, SerializedProperty asset) {
            Event now = Event.current;
            bool dropped = now.type == EventType.DragPerform;
            if (!GUI.enabled || !dropped && now.type != EventType.DragUpdated || !place.Contains(now.mousePosition)) return;
            GaussianAvatarAsset dragged = AssetOf(DragAndDrop.objectReferences);
            if (dragged == null) return;
            DragAndDrop.visualMode = DragAndDropVisualMode.Link;
            if (dropped) {
                DragAndDrop.AcceptDrag();
                asset.objectReferenceValue = dragged;
            }
            now.Use();
        }

        /// <summary>The asset of the first object that has a component; null if none has.</summary>
        private static GaussianAvatarAsset AssetOf(IEnumerable<Object> dragged) {
            foreach (Object one in dragged) {
                var owner = one as GameObject;
                GaussianAvatar component = owner == null ? null : owner.GetComponent<GaussianAvatar>();
                if (component != null) return component.Asset;
            }
            return null;
        }
    }
}
