using System;
using System.Collections.Generic;
using AvatarExport.Core;
using UnityEditor;
using UnityEngine;
using Object = UnityEngine.Object;

namespace AvatarExport.Editor {
    /// <summary>
    /// The inspector of the component: sliders of expressions in groups, with a search; level and clip, with a scrubber; what does not
    /// suit avatars. Sliders set the blend shapes of the hidden mesh, so they work in edit mode, can be undone, and are
    /// recorded by the Animation and Timeline windows.
    /// </summary>
    [CustomEditor(typeof(GaussianAvatar))]
    public sealed class GaussianAvatarEditor : UnityEditor.Editor {
        private readonly HashSet<string> open = new HashSet<string>();
        private string search = "";

        /// <summary>Called by Unity to draw.</summary>
        public override void OnInspectorGUI() {
            var component = (GaussianAvatar)target;
            serializedObject.Update();
            GaussianAvatarAsset before = component.Asset;
            AssetField.Draw(serializedObject.FindProperty("asset"));
            DrawPropertiesExcluding(serializedObject, "m_Script", "asset", "expressions", "level", "clip");
            serializedObject.ApplyModifiedProperties();
            if (component.Asset != before) component.Reload();
            LoadedAvatar avatar = component.Avatar;
            if (avatar == null) {
                EditorGUILayout.HelpBox(Problem(component), MessageType.Warning);
                return;
            }
            DrawChoices(component, avatar);
            ProjectCheckMenu.DrawFindings();
            if (component.Proxy == null) {
                EditorGUILayout.HelpBox("This object has no hidden mesh: drag NAME.avatar into the scene to get one.", MessageType.Info);
                return;
            }
            DrawSliders(component, avatar);
        }

        /// <summary>Asked by Unity by this name, when F is pressed over the Scene view.</summary>
        public bool HasFrameBounds() => ((GaussianAvatar)target).Avatar != null;

        /// <summary>Asked by Unity by this name: what F brings near. The one renderer is off, and has no bounds.</summary>
        public Bounds OnGetFrameBounds() => ((GaussianAvatar)target).WorldBounds;

        private static string Problem(GaussianAvatar component) {
            if (component.Asset == null) return "No avatar: drag NAME.avatar from the Project window into the field Asset.";
            try {
                component.Asset.Load();
                return "The avatar is not shown while this object is disabled.";
            } catch (AvatarError error) {
                return error.Message;
            }
        }

        /// <summary>Level of detail, the clip that the component plays, and where in it, which is for looking at it in edit mode.</summary>
        private void DrawChoices(GaussianAvatar component, LoadedAvatar avatar) {
            string[] levels = Array.ConvertAll(avatar.Levels, one => one.Count + " splats");
            string[] clips = Array.ConvertAll(avatar.Clips, one => one.Name);
            SerializedProperty level = serializedObject.FindProperty("level"), clip = serializedObject.FindProperty("clip");
            level.intValue = Choose("Level", "Automatic", levels, level.intValue);
            int before = Array.IndexOf(clips, clip.stringValue), chosen = Choose("Clip", "none", clips, before);
            clip.stringValue = chosen < 0 ? "" : clips[chosen];
            bool changed = serializedObject.ApplyModifiedProperties();
            if (chosen != before && chosen < 0) component.Stop();
            if (chosen != before && chosen >= 0) component.Play(clips[chosen]);
            if (chosen >= 0) {
                float length = (float)avatar.Clips[chosen].Seconds;
                float seconds = EditorGUILayout.Slider("Seconds", (float)component.ClipSeconds, 0, length);
                bool moved = seconds != (float)component.ClipSeconds;
                if (moved) component.ClipSeconds = seconds;
                changed |= moved;
            }
            if (changed) Refresh(component);
        }

        /// <summary>An index into "names", or -1 for "other", which stands first.</summary>
        private static int Choose(string label, string other, string[] names, int chosen) {
            var choices = new string[names.Length + 1];
            choices[0] = other;
            names.CopyTo(choices, 1);
            return EditorGUILayout.Popup(label, Mathf.Clamp(chosen + 1, 0, names.Length), choices) - 1;
        }

        private void DrawSliders(GaussianAvatar component, LoadedAvatar avatar) {
            SkinnedMeshRenderer proxy = component.Proxy;
            EditorGUILayout.Space();
            EditorGUILayout.LabelField("Expressions", EditorStyles.boldLabel);
            search = EditorGUILayout.TextField("Search", search);
            string[] names = Names(proxy.sharedMesh);
            foreach (ExpressionGroup group in ExpressionGroups.Of(names, search)) {
                bool shown = EditorGUILayout.Foldout(open.Contains(group.Title), group.Title, true);
                if (shown) open.Add(group.Title);
                else open.Remove(group.Title);
                if (!shown && search.Length == 0) continue;
                foreach (int index in group.Members) DrawSlider(component, avatar, names[index], index);
            }
            if (GUILayout.Button("Reset")) Reset(component);
        }

        private static void DrawSlider(GaussianAvatar component, LoadedAvatar avatar, string name, int index) {
            SkinnedMeshRenderer proxy = component.Proxy;
            bool late = index >= avatar.Expressions.Length;
            float low = late ? 0 : (float)avatar.Expressions[index].Low, high = late ? 1 : (float)avatar.Expressions[index].High;
            float weight = proxy.GetBlendShapeWeight(index) / ClipCurves.Percent;
            EditorGUI.BeginChangeCheck();
            float chosen = EditorGUILayout.Slider(name, weight, Mathf.Min(low, weight), Mathf.Max(high, weight));
            if (!EditorGUI.EndChangeCheck()) return;
            Undo.RecordObject(proxy, "Expression " + name);
            Undo.RecordObject(component, "Expression " + name);
            component.ClearExpression(name); // a script's weight would hide this one
            proxy.SetBlendShapeWeight(index, chosen * ClipCurves.Percent);
            Refresh(component);
            Refresh(proxy);
        }

        /// <summary>All expressions at 0 and all bones at rest.</summary>
        private void Reset(GaussianAvatar component) {
            Undo.RegisterFullObjectHierarchyUndo(component.gameObject, "Reset avatar");
            component.ResetPose();
            Refresh(component);
        }

        private static void Refresh(Object changed) {
            EditorUtility.SetDirty(changed);
            PrefabUtility.RecordPrefabInstancePropertyModifications(changed); // what is no prefab is left alone
            EditorApplication.QueuePlayerLoopUpdate();
        }

        /// <summary>The names of the blend shapes.</summary>
        internal static string[] Names(Mesh mesh) {
            var names = new string[mesh.blendShapeCount];
            for (int k = 0; k < names.Length; k++) names[k] = mesh.GetBlendShapeName(k);
            return names;
        }
    }
}
