using System;
using System.Collections.Generic;
using AvatarExport.Core;
using UnityEngine;

namespace AvatarExport.Editor {
    /// <summary>Where the parts of an avatar lie below its topmost object: what curves of AnimationClips name.</summary>
    public struct RigPaths {
        /// <summary>The paths below `owner`, of objects that AvatarRig.Build made there. `bones` are in the order of Skeleton.Names.</summary>
        public static RigPaths Below(Transform owner, SkinnedMeshRenderer proxy, Transform[] bones) {
            return new RigPaths {
                Mesh = Path(owner, proxy.transform),
                Root = Path(owner, proxy.transform.parent),
                Bones = Array.ConvertAll(bones, bone => Path(owner, bone)),
            };
        }

        private static string Path(Transform owner, Transform below) {
            return below.parent == owner ? below.name : Path(owner, below.parent) + "/" + below.name;
        }

        /// <summary>Of the SkinnedMeshRenderer with the blend shapes.</summary>
        public string Mesh;

        /// <summary>Of the object above the bones, which a clip may move.</summary>
        public string Root;

        /// <summary>Of each bone, in the order of Skeleton.Names.</summary>
        public string[] Bones;
    }

    /// <summary>Clips of a pack as AnimationClips: a key in each frame, straight lines between keys.</summary>
    public static class ClipCurves {
        /// <summary>Blend shape weight of an expression of weight 1: what Unity's tools expect.</summary>
        public const float Percent = 100;

        private static readonly string[] Axes = { "x", "y", "z", "w" };

        /// <summary>
        /// A clip with curves for what changes and for what differs from rest: `blendShape.NAME` from 0 to 100, bones, and
        /// the movement of the whole avatar. `shapes` are the names of the blend shapes: expressions, then eyelids.
        /// </summary>
        public static AnimationClip Of(LoadedAvatar avatar, Clip clip, IReadOnlyList<string> shapes, RigPaths paths) {
            var made = new AnimationClip { name = clip.Name, frameRate = (float)clip.Fps };
            Recorded recorded = Record(avatar, clip);
            for (int k = 0; k < shapes.Count; k++) {
                Set(made, paths.Mesh, typeof(SkinnedMeshRenderer), "blendShape." + shapes[k], recorded, k, 0);
            }
            int at = shapes.Count;
            if (avatar.Skeleton == null) return made;
            at = SetTransform(made, paths.Root, recorded, at, false);
            for (int joint = 0; joint < paths.Bones.Length; joint++) at = SetTransform(made, paths.Bones[joint], recorded, at, true);
            return made;
        }

        /// <summary>Tracks of all frames: blend shapes, the root's translation and rotation, and each bone's with its scale.</summary>
        private sealed class Recorded {
            internal double Fps;
            internal List<float[]> Tracks; // [tracks][frames]
        }

        private static Recorded Record(LoadedAvatar avatar, Clip clip) {
            int frames = clip.Frames;
            int joints = avatar.Skeleton == null ? 0 : avatar.Skeleton.Names.Length;
            var pose = new AvatarPose(avatar);
            var bones = new Bones(joints);
            BoneFrames poser = joints > 0 ? new BoneFrames(avatar) : null;
            double[] translation = new double[3], rotation = { 0, 0, 0, 1 };
            var tracks = new List<float[]>();
            int count = pose.ExpressionWeights.Length + pose.LateWeights.Length + 7 + 10 * joints;
            for (int track = 0; track < count; track++) tracks.Add(new float[frames]);
            for (int frame = 0; frame < frames; frame++) {
                clip.Pose(frame / clip.Fps, pose);
                if (poser != null) {
                    poser.ToRoot(pose, translation, rotation);
                    poser.ToBones(pose, bones);
                }
                int at = 0;
                foreach (float weight in pose.ExpressionWeights) tracks[at++][frame] = Percent * weight;
                foreach (float weight in pose.LateWeights) tracks[at++][frame] = Percent * weight;
                at = Take(tracks, at, frame, translation, 0, 3);
                at = TakeTurn(tracks, at, frame, rotation, 0);
                for (int joint = 0; joint < joints; joint++) {
                    at = Take(tracks, at, frame, bones.Translation, 3 * joint, 3);
                    at = TakeTurn(tracks, at, frame, bones.Rotation, 4 * joint);
                    at = Take(tracks, at, frame, bones.Scale, 3 * joint, 3);
                }
            }
            return new Recorded { Fps = clip.Fps, Tracks = tracks };
        }

        private static int Take(List<float[]> tracks, int at, int frame, double[] values, int from, int count) {
            for (int i = 0; i < count; i++) tracks[at + i][frame] = (float)values[from + i];
            return at + count;
        }

        /// <summary>A quaternion with the sign that is nearer to the frame before: the line between the two is then the short way.</summary>
        private static int TakeTurn(List<float[]> tracks, int at, int frame, double[] values, int from) {
            double along = 0;
            for (int i = 0; i < 4 && frame > 0; i++) along += tracks[at + i][frame - 1] * values[from + i];
            for (int i = 0; i < 4; i++) tracks[at + i][frame] = (float)(along < 0 ? -values[from + i] : values[from + i]);
            return at + 4;
        }

        private static int SetTransform(AnimationClip clip, string path, Recorded recorded, int at, bool scales) {
            for (int i = 0; i < 3; i++) Set(clip, path, typeof(Transform), "localPosition." + Axes[i], recorded, at++, null);
            for (int i = 0; i < 4; i++) Set(clip, path, typeof(Transform), "localRotation." + Axes[i], recorded, at++, null);
            for (int i = 0; i < 3 && scales; i++) Set(clip, path, typeof(Transform), "localScale." + Axes[i], recorded, at++, null);
            return at;
        }

        /// <summary>A curve, unless it would hold `rest` throughout. Null: always, since a bone needs all its components.</summary>
        private static void Set(AnimationClip clip, string path, Type type, string property, Recorded recorded, int track, float? rest) {
            float[] values = recorded.Tracks[track];
            bool still = Array.TrueForAll(values, value => value == values[0]);
            if (still && rest == values[0]) return;
            clip.SetCurve(path, type, property, Lines(values, recorded.Fps, still));
        }

        /// <summary>Keys at every frame with straight lines between them; one key at each end if nothing moves.</summary>
        private static AnimationCurve Lines(float[] values, double fps, bool still) {
            int step = still ? Math.Max(1, values.Length - 1) : 1;
            var keys = new List<Keyframe>();
            for (int frame = 0; frame < values.Length; frame += step) {
                float before = still || frame == 0 ? 0 : (float)((values[frame] - values[frame - 1]) * fps);
                float after = still || frame == values.Length - 1 ? 0 : (float)((values[frame + 1] - values[frame]) * fps);
                keys.Add(new Keyframe((float)(frame / fps), values[frame], before, after));
            }
            return new AnimationCurve(keys.ToArray());
        }
    }
}
