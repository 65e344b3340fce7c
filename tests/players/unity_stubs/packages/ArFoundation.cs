// Stands in for ARFoundation and ARKit in tests. Signatures are theirs; bodies are ours.
using System;
using System.Collections.Generic;
using UnityEngine.XR.ARSubsystems;

namespace Unity.Collections
{
    public enum Allocator { Temp = 2 }

    public struct NativeArray<T> : IDisposable where T : struct
    {
        public int Length { get { return 0; } }
        public T this[int index] { get { return default(T); } }
        public void Dispose() { }
    }
}

namespace UnityEngine.XR.ARSubsystems
{
    public struct TrackableId { }

    public enum TrackingState { None, Limited, Tracking }

    public class XRFaceSubsystem { }
}

namespace UnityEngine.XR.ARKit
{
    public enum ARKitBlendShapeLocation { BrowDownLeft, BrowDownRight }

    public struct ARKitBlendShapeCoefficient
    {
        public ARKitBlendShapeLocation blendShapeLocation { get { return ARKitBlendShapeLocation.BrowDownLeft; } }
        public float coefficient { get { return 0; } }
    }

    public class ARKitFaceSubsystem : XRFaceSubsystem
    {
        public Unity.Collections.NativeArray<ARKitBlendShapeCoefficient> GetBlendShapeCoefficients(
            TrackableId faceId, Unity.Collections.Allocator allocator)
        {
            return new Unity.Collections.NativeArray<ARKitBlendShapeCoefficient>();
        }
    }
}

namespace UnityEngine.XR.ARFoundation
{
    public class ARFace : MonoBehaviour
    {
        public TrackableId trackableId { get { return new TrackableId(); } }
        public TrackingState trackingState { get { return TrackingState.None; } }
    }

    public struct TrackableCollection<TTrackable>
    {
        public struct Enumerator
        {
            public TTrackable Current { get { return default(TTrackable); } }
            public bool MoveNext() { return false; }
        }
        public Enumerator GetEnumerator() { return new Enumerator(); }
    }

    public class ARFaceManager : MonoBehaviour
    {
        public XRFaceSubsystem subsystem { get { return null; } }
        public TrackableCollection<ARFace> trackables { get { return new TrackableCollection<ARFace>(); } }
    }
}
