using AvatarExport.Core;
using UnityEngine;

namespace AvatarExport.Samples {
    /// <summary>A head with a panel: a slider for each expression, a button for each clip.</summary>
    public sealed class HeadPanel : MonoBehaviour {
        private const float Width = 320;
        private GaussianAvatar head;
        private Vector2 scrolled;

        private void Start() {
            var prefab = Resources.Load<GameObject>("sample_head");
            if (prefab == null) {
                Debug.LogError("sample_head.avatar is missing: import the sample again in the Package Manager.", this);
                enabled = false;
                return;
            }
            head = Instantiate(prefab, transform).GetComponent<GaussianAvatar>();
        }

        private void OnGUI() {
            if (head == null || head.Avatar == null) return;
            GUILayout.BeginArea(new Rect(10, 10, Width, Screen.height - 20), GUI.skin.box);
            DrawClips();
            scrolled = GUILayout.BeginScrollView(scrolled);
            foreach (Expression expression in head.Avatar.Expressions) DrawSlider(expression);
            GUILayout.EndScrollView();
            GUILayout.EndArea();
        }

        private void DrawClips() {
            GUILayout.BeginHorizontal();
            foreach (Clip clip in head.Avatar.Clips) {
                if (GUILayout.Button(clip.Name)) head.Play(clip.Name);
            }
            if (GUILayout.Button("Stop")) head.Stop();
            if (GUILayout.Button("Reset")) head.ResetPose();
            GUILayout.EndHorizontal();
        }

        private void DrawSlider(Expression expression) {
            float weight = head.GetExpression(expression.Name);
            GUILayout.BeginHorizontal();
            GUILayout.Label(expression.Name, GUILayout.Width(Width / 2));
            float chosen = GUILayout.HorizontalSlider(weight, (float)expression.Low, (float)expression.High);
            GUILayout.EndHorizontal();
            if (chosen != weight) head.SetExpression(expression.Name, chosen);
        }
    }
}
