using System;
using AvatarExport.Core;
using Unity.Collections;
using UnityEngine;
using UnityEngine.XR.ARFoundation;
using UnityEngine.XR.ARKit;
using UnityEngine.XR.ARSubsystems;

namespace AvatarExport {
    /// <summary>
    /// The face that ARFoundation sees, on an iPhone or iPad with ARKit. The head turns against the camera. ARKit
    /// counts eyes among its weights.
    /// </summary>
    [AddComponentMenu("Gaussian Avatar/AR Face")]
    public sealed class ArFaceSource : ArkitSource {
        [SerializeField, Tooltip("The ARFaceManager of the session.")]
        private ARFaceManager faces;

        [SerializeField, Tooltip("The AR camera.")]
        private Camera view;

        private readonly int[] places = Places(); // of ARKit's locations in Arkit.Names

        /// <summary>The manager of the session's faces.</summary>
        public ARFaceManager Faces {
            get => faces;
            set => faces = value;
        }

        /// <summary>The camera of the session.</summary>
        public Camera View {
            get => view;
            set => view = value;
        }

        /// <inheritdoc/>
        public override bool Read(DrivingFrame into) {
            if (faces == null || view == null) return false;
            var subsystem = faces.subsystem as ARKitFaceSubsystem;
            if (subsystem == null) return false;
            foreach (ARFace face in faces.trackables) {
                if (face.trackingState != TrackingState.Tracking) continue;
                Take(subsystem, face, into);
                return true;
            }
            return false;
        }

        private void Take(ARKitFaceSubsystem subsystem, ARFace face, DrivingFrame into) {
            TrackableId id = face.trackableId;
            using (NativeArray<ARKitBlendShapeCoefficient> weights
                = subsystem.GetBlendShapeCoefficients(id, Allocator.Temp)) {
                for (int i = 0; i < weights.Length; i++) {
                    int place = places[(int)weights[i].blendShapeLocation];
                    if (place >= 0) into.Weights[place] = weights[i].coefficient;
                }
            }
            Quaternion turn = Quaternion.Inverse(view.transform.rotation) * face.transform.rotation;
            HeadAngles.Write(turn, into.Head);
            Array.Clear(into.LeftEye, 0, 3);
            Array.Clear(into.RightEye, 0, 3);
        }

        private static int[] Places() {
            string[] locations = Enum.GetNames(typeof(ARKitBlendShapeLocation));
            return Array.ConvertAll(
                locations,
                    one => Array.FindIndex(Arkit.Names,
                    name => name.Equals(one, StringComparison.OrdinalIgnoreCase)));
        }
    }
}
