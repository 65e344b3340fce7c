using System.Net;
using System.Net.Sockets;
using AvatarExport.Core;
using UnityEngine;

namespace AvatarExport {
    /// <summary>
    /// Receives the app Live Link Face over UDP. In the app's settings add this machine's address as a target, with the
    /// same port. Receiving allocates nothing.
    /// </summary>
    [AddComponentMenu("Gaussian Avatar/Live Link Face")]
    public sealed class LiveLinkFace : ArkitSource {
        private const int MostBytes = 2048; // of a packet
        private const int MostPackets = 64; // a frame: a flood must not stop the frame

        [SerializeField, Tooltip("UDP port; the app's own is 11111.")]
        private int port = 11111;

        [SerializeField, Tooltip("Seconds without a packet after which the face counts as gone.")]
        private float holdSeconds = 0.5f;

        private readonly byte[] packet = new byte[MostBytes];
        private readonly DrivingFrame newest = new DrivingFrame();
        private Socket socket;
        private bool received;
        private float lastSeconds;

        /// <summary>UDP port. Setting it opens the new one.</summary>
        public int Port {
            get => port;
            set {
                port = value;
                if (!isActiveAndEnabled) return;
                Close();
                Open();
            }
        }

        /// <inheritdoc/>
        public override bool Read(DrivingFrame into) {
            Receive();
            if (!received || Time.realtimeSinceStartup - lastSeconds > holdSeconds) return false;
            Copy(newest, into);
            return true;
        }

        private void OnEnable() => Open();

        private void OnDisable() => Close();

        private void Receive() {
            if (socket == null) return;
            try {
                for (int i = 0; i < MostPackets && socket.Available > 0; i++) {
                    int length = socket.Receive(packet, 0, MostBytes, SocketFlags.None);
                    if (!LiveLinkPacket.Read(packet, length, newest)) continue;
                    received = true;
                    lastSeconds = Time.realtimeSinceStartup;
                }
            } catch (SocketException error) {
                Warnings.Once($"Live Link Face, port {port}: {error.Message}", this);
            }
        }

        private void Open() {
            try {
                socket = new Socket(AddressFamily.InterNetwork, SocketType.Dgram, ProtocolType.Udp);
                socket.Bind(new IPEndPoint(IPAddress.Any, port));
            } catch (System.Exception error) when (error is SocketException
                || error is System.ArgumentOutOfRangeException || error is System.NotSupportedException) { // Web
                Close();
                string told = $"Live Link Face cannot listen on UDP port {port}: {error.Message}. ";
                Warnings.Once(told + "Choose another port here and in the app", this);
            }
        }

        private void Close() {
            if (socket != null) socket.Close();
            socket = null;
            received = false;
        }
    }
}
