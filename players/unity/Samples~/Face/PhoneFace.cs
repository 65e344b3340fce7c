using System.Net;
using System.Net.Sockets;
using AvatarExport.Core;
using UnityEngine;

namespace AvatarExport.Samples {
    /// <summary>A head that follows the app Live Link Face on an iPhone. The panel says which address to enter in the app.</summary>
    public sealed class PhoneFace : MonoBehaviour {
        private const int Port = 11111;
        private readonly DrivingFrame frame = new DrivingFrame();
        private LiveLinkFace face;
        private string addresses = "";

        private void Start() {
            var prefab = Resources.Load<GameObject>("sample_face");
            if (prefab == null) {
                Debug.LogError("sample_face.avatar is missing: import the sample again in the Package Manager.", this);
                enabled = false;
                return;
            }
            GaussianAvatar head = Instantiate(prefab, transform).GetComponent<GaussianAvatar>();
            face = head.gameObject.AddComponent<LiveLinkFace>();
            face.Port = Port;
            head.LiveInput = face;
            addresses = Addresses();
        }

        private void OnGUI() {
            if (face == null) return;
            GUILayout.BeginArea(new Rect(10, 10, 420, 80), GUI.skin.box);
            GUILayout.Label("Live Link Face: add the target " + addresses + ", port " + Port);
            GUILayout.Label(face.Read(frame) ? "A face arrives." : "No face arrives now.");
            GUILayout.EndArea();
        }

        private static string Addresses() {
            try {
                string found = "";
                foreach (IPAddress address in Dns.GetHostAddresses(Dns.GetHostName())) {
                    if (address.AddressFamily == AddressFamily.InterNetwork) found += (found.Length == 0 ? "" : " or ") + address;
                }
                return found.Length == 0 ? "of this computer" : found;
            } catch (SocketException) {
                return "of this computer";
            }
        }
    }
}
