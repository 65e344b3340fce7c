// Stands in for ARFoundation and ARKit in tests. Signatures are theirs; bodies are ours.
using System;
using System.Collections.Generic;
using UnityEngine.XR.ARSubsystems;

namespace Unity.Collections {
    public enum Allocator { Temp = 2 }

    public struct NativeArray<T> : IDisposable where T : struct {
        public int Length => 0;
        public T this[int index] => default(T);
        public void Dispose() { }
    }
}

namespace UnityEngine.XR.ARSubsystems {
    public struct TrackableId { }
    public enum TrackingState { None, Limited, Tracking }
    public class XRFaceSubsystem { }
}

namespace UnityEngine.XR.ARKit {
    public enum ARKitBlendShapeLocation { BrowDownLeft, BrowDownRight }

    public struct ARKitBlendShapeCoefficient {
        public ARKitBlendShapeLocation blendShapeLocation => ARKitBlendShapeLocation.BrowDownLeft;
        public float coefficient => 0;
    }

    public class ARKitFaceSubsystem : XRFaceSubsystem {
        public Unity.Collections.NativeArray<ARKitBlendShapeCoefficient> GetBlendShapeCoefficients(
            TrackableId faceId, Unity.Collections.Allocator allocator) {
            return new Unity.Collections.NativeArray<ARKitBlendShapeCoefficient>();
        }
    }
}

namespace UnityEngine.XR.ARFoundation {
    public class ARFace : MonoBehaviour {
        public TrackableId trackableId => new TrackableId();
        public TrackingState trackingState => TrackingState.None;
    }

    public struct TrackableCollection<TTrackable> {
        public struct Enumerator {
            public TTrackable Current => default(TTrackable);
            public bool MoveNext() => false;
        }
        public Enumerator GetEnumerator() => new Enumerator();
    }

    public class ARFaceManager : MonoBehaviour {
        public XRFaceSubsystem subsystem => null;
        public TrackableCollection<ARFace> trackables => new TrackableCollection<ARFace>();
    }
}
