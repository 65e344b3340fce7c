using UnityEngine;

namespace AvatarExport.Samples {
    /// <summary>A body that walks by a clip of its file. A slider turns its neck, a bone that then wins over the clip.</summary>
    public sealed class WalkingBody : MonoBehaviour {
        private const string Neck = "Skeleton_neck_joint_2";
        private GaussianAvatar body;
        private Transform neck;
        private Quaternion rest;
        private float degrees;

        private void Start() {
            var prefab = Resources.Load<GameObject>("sample_body");
            if (prefab == null) {
                Debug.LogError("sample_body.avatar is missing: import the sample again in the Package Manager.", this);
                enabled = false;
                return;
            }
            body = Instantiate(prefab, transform).GetComponent<GaussianAvatar>();
            body.Play("walk");
            foreach (Transform bone in body.Bones) {
                if (bone.name == Neck) neck = bone;
            }
            rest = neck.localRotation;
        }

        private void OnGUI() {
            if (neck == null) return;
            GUILayout.BeginArea(new Rect(10, 10, 320, 60), GUI.skin.box);
            GUILayout.Label("Turn the neck");
            float chosen = GUILayout.HorizontalSlider(degrees, -60, 60);
            GUILayout.EndArea();
            if (chosen == degrees) return;
            degrees = chosen;
            neck.localRotation = rest * Quaternion.Euler(degrees, 0, 0);
        }
    }
}
