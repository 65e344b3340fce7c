using System;
using AvatarExport.Core;
using UnityEngine;

namespace AvatarExport {
    /// <summary>Something that captures a face: 52 ARKit weights, the rotations of head and eyes.</summary>
    public abstract class ArkitSource : MonoBehaviour {
        /// <summary>
        /// Writes the newest frame. Returns false where no face is seen now. Called once a frame; must not allocate.
        /// </summary>
        public abstract bool Read(DrivingFrame into);

        /// <summary>Takes all values of another frame.</summary>
        protected static void Copy(DrivingFrame from, DrivingFrame into) {
            Array.Copy(from.Weights, into.Weights, into.Weights.Length);
            Array.Copy(from.Head, into.Head, into.Head.Length);
            Array.Copy(from.LeftEye, into.LeftEye, into.LeftEye.Length);
            Array.Copy(from.RightEye, into.RightEye, into.RightEye.Length);
        }
    }
}
