// Stubs of Unity's animation classes that the Editor assembly uses. Signatures as in Unity's public C# reference, release
// 2022.3.9f1. A clip keeps its curves by path, type and property; a curve is a cubic Hermite spline, as Unity's manual says.
using System;
using System.Collections.Generic;
using System.Linq;
using UnityEngine;

namespace UnityEngine {
    public struct Keyframe {
        public Keyframe(float time, float value, float inTangent, float outTangent) {
            this.time = time;
            this.value = value;
            this.inTangent = inTangent;
            this.outTangent = outTangent;
        }

        public float time { get; set; }
        public float value { get; set; }
        public float inTangent { get; set; }
        public float outTangent { get; set; }
    }

    public class AnimationCurve {
        public AnimationCurve(params Keyframe[] keys) { this.keys = keys; }
        public Keyframe[] keys { get; set; }

        public float Evaluate(float time) {
            int next = Array.FindIndex(keys, key => key.time > time);
            if (next < 0) return keys[keys.Length - 1].value;
            if (next == 0) return keys[0].value;
            Keyframe a = keys[next - 1], b = keys[next];
            double width = b.time - a.time, t = (time - a.time) / width, u = 1 - t;
            double left = (1 + 2 * t) * u * u * a.value + t * u * u * width * a.outTangent;
            return (float)(left + t * t * (3 - 2 * t) * b.value - t * t * u * width * b.inTangent);
        }
    }

    public class Motion : Object { }

    public sealed class AnimationClip : Motion {
        internal readonly Dictionary<UnityEditor.EditorCurveBinding, AnimationCurve> Curves
            = new Dictionary<UnityEditor.EditorCurveBinding, AnimationCurve>();

        public float frameRate { get; set; }

        public void SetCurve(string relativePath, Type type, string propertyName, AnimationCurve curve) {
            Curves[UnityEditor.EditorCurveBinding.FloatCurve(relativePath, type, propertyName)] = curve;
        }
    }
}

namespace UnityEditor {
    public struct EditorCurveBinding {
        public string path;
        public string propertyName;
        public Type type { get; set; }

        public static EditorCurveBinding FloatCurve(string inPath, Type inType, string inPropertyName) {
            return new EditorCurveBinding { path = inPath, type = inType, propertyName = inPropertyName };
        }
    }

    public class AnimationUtility {
        public static AnimationCurve GetEditorCurve(AnimationClip clip, EditorCurveBinding binding) {
            AnimationCurve found;
            return clip.Curves.TryGetValue(binding, out found) ? found : null;
        }

        public static EditorCurveBinding[] GetCurveBindings(AnimationClip clip) => clip.Curves.Keys.ToArray();
    }
}
