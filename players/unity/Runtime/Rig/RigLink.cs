using AvatarExport.Core;
using UnityEngine;

namespace AvatarExport {
    /// <summary>
    /// The blend shapes and bones below an avatar, and the pose: what something else moved is read, all else is
    /// written, so that shadows, colliders and what hangs on a bone follow. A value counts as moved once it differs
    /// from what was written here, and from rest at first; it stays so until Release.
    /// </summary>
    internal sealed class RigLink {
        private const float Percent = 100; // a blend shape weight of 100 is an expression weight of 1
        private const float Still = 1e-6f; // metres, parts of a quaternion, parts of a scale: less is no movement

        private readonly Transform root;
        private readonly SkinnedMeshRenderer proxy;
        private readonly Transform[] joints;
        private readonly BoneFrames frames; // null without bones
        private readonly Bones bones;
        private readonly AvatarPose shaped; // weights of blend shapes that were moved
        private readonly AvatarPose boned; // joints of bones that were moved
        private readonly PoseMask moved;
        private readonly float[] shapes; // as last written or read, percent
        private readonly Vector3[] positions; // the same of bones; the last one is the root's
        private readonly Quaternion[] rotations;
        private readonly Vector3[] scales;
        private readonly double[] rootTranslation = new double[3];
        private readonly double[] rootRotation = new double[4];
        private readonly int expressions;

        /// <summary>
        /// "joints" are in the order of Skeleton.Names, or empty. Throws AvatarError for a rig that bones cannot show.
        /// </summary>
        public RigLink(LoadedAvatar avatar, Transform root, SkinnedMeshRenderer proxy, Transform[] joints) {
            this.root = root;
            this.proxy = proxy;
            this.joints = joints;
            shaped = new AvatarPose(avatar);
            boned = new AvatarPose(avatar);
            moved = new PoseMask(shaped);
            expressions = shaped.ExpressionWeights.Length;
            int count = expressions + shaped.LateWeights.Length;
            shapes = new float[proxy == null || proxy.sharedMesh == null
                ? 0 : Mathf.Min(count, proxy.sharedMesh.blendShapeCount)];
            positions = new Vector3[joints.Length + 1];
            rotations = new Quaternion[joints.Length + 1];
            scales = new Vector3[joints.Length + 1];
            Note(joints.Length, Vector3.zero, Quaternion.identity, Vector3.one);
            if (joints.Length == 0) return;
            frames = new BoneFrames(avatar);
            bones = new Bones(joints.Length);
            frames.Rest(boned, bones);
            for (int i = 0; i < joints.Length; i++) Note(i, Translation(i), Rotation(i), Scale(i));
        }

        /// <summary>Whether all its objects are still there: a hand or a script may delete them.</summary>
        public bool IsWhole {
            get {
                bool whole = root != null && (shapes.Length == 0 || proxy != null);
                for (int i = 0; i < joints.Length && whole; i++) whole = joints[i] != null;
                return whole;
            }
        }

        /// <summary>Puts blend shapes and bones to rest. Nothing counts as moved any more, until it moves.</summary>
        public void Release() {
            moved.Clear();
            shaped.Reset();
            Write(shaped, moved);
        }

        /// <summary>Reads the blend shapes, and copies the weights of those that were moved.</summary>
        public void ReadShapes(AvatarPose into) {
            for (int i = 0; i < shapes.Length; i++) {
                float weight = proxy.GetBlendShapeWeight(i);
                if (Mathf.Abs(weight - shapes[i]) > Still) MarkMoved(i);
                shapes[i] = weight;
                if (i < expressions) shaped.ExpressionWeights[i] = weight / Percent;
                else shaped.LateWeights[i - expressions] = weight / Percent;
            }
            moved.CopyWeights(shaped, into);
        }

        /// <summary>
        /// Reads the bones, and copies the joints of those that were moved. The expressions of "into" move rest joints.
        /// </summary>
        public void ReadBones(AvatarPose into) {
            if (frames == null) return;
            bool any = ReadRoot();
            for (int i = 0; i < joints.Length; i++) {
                Vector3 position = joints[i].localPosition, scale = joints[i].localScale;
                Quaternion rotation = joints[i].localRotation;
                moved.Joints[i] |= !IsStill(i, position, rotation, scale);
                any |= moved.Joints[i];
                Note(i, position, rotation, scale);
                Put(i, position, rotation, scale);
            }
            if (!any) return;
            System.Array.Copy(into.ExpressionWeights, boned.ExpressionWeights, expressions);
            frames.FromBones(bones, boned);
            moved.CopyJoints(boned, into);
        }

        /// <summary>
        /// Writes a pose to what was not moved, or is set by "above": sources that win over blend shapes and bones.
        /// </summary>
        public void Write(AvatarPose pose, PoseMask above) {
            for (int i = 0; i < shapes.Length; i++) {
                bool late = i >= expressions;
                int at = late ? i - expressions : i;
                if (late ? moved.Late[at] && !above.Late[at] : moved.Expressions[at] && !above.Expressions[at]) {
                    continue;
                }
                float weight = Percent * (late ? pose.LateWeights[at] : pose.ExpressionWeights[at]);
                if (weight == shapes[i]) continue;
                proxy.SetBlendShapeWeight(i, weight);
                shapes[i] = proxy.GetBlendShapeWeight(i); // what is read the next time: a project may clamp it
            }
            if (frames == null) return;
            frames.ToBones(pose, bones);
            for (int i = 0; i < joints.Length; i++) {
                if (!moved.Joints[i] || above.Joints[i]) WriteBone(joints[i], i, Translation(i), Rotation(i), Scale(i));
            }
            if (moved.Root && !above.Root) return;
            frames.ToRoot(pose, rootTranslation, rootRotation);
            WriteBone(root, joints.Length, Turns.Vector(rootTranslation, 0), Turns.Turn(rootRotation, 0), Vector3.one);
        }

        private void WriteBone(Transform bone, int i, Vector3 position, Quaternion rotation, Vector3 scale) {
            if (positions[i] == position && rotations[i].Equals(rotation) && scales[i] == scale) return;
            bone.localPosition = position;
            bone.localRotation = rotation;
            bone.localScale = scale;
            Note(i, bone.localPosition, bone.localRotation, bone.localScale); // what is read the next time
        }

        private bool ReadRoot() {
            int at = joints.Length;
            Vector3 position = root.localPosition;
            Quaternion rotation = root.localRotation;
            moved.Root |= !IsStill(at, position, rotation, scales[at]);
            Note(at, position, rotation, scales[at]);
            if (!moved.Root) return false;
            for (int c = 0; c < 3; c++) rootTranslation[c] = position[c];
            for (int c = 0; c < 4; c++) rootRotation[c] = rotation[c];
            frames.FromRoot(rootTranslation, rootRotation, boned);
            return true;
        }

        private void MarkMoved(int shape) {
            if (shape < expressions) moved.Expressions[shape] = true;
            else moved.Late[shape - expressions] = true;
        }

        private bool IsStill(int i, Vector3 position, Quaternion rotation, Vector3 scale) {
            bool still = true;
            for (int c = 0; c < 3; c++) {
                still &= Mathf.Abs(position[c] - positions[i][c]) <= Still
                    && Mathf.Abs(scale[c] - scales[i][c]) <= Still;
            }
            for (int c = 0; c < 4; c++) still &= Mathf.Abs(rotation[c] - rotations[i][c]) <= Still;
            return still;
        }

        private void Note(int i, Vector3 position, Quaternion rotation, Vector3 scale) {
            positions[i] = position;
            rotations[i] = rotation;
            scales[i] = scale;
        }

        private void Put(int i, Vector3 position, Quaternion rotation, Vector3 scale) {
            for (int c = 0; c < 3; c++) {
                bones.Translation[3 * i + c] = position[c];
                bones.Scale[3 * i + c] = scale[c];
            }
            for (int c = 0; c < 4; c++) bones.Rotation[4 * i + c] = rotation[c];
        }

        private Vector3 Translation(int i) => Turns.Vector(bones.Translation, 3 * i);

        private Quaternion Rotation(int i) => Turns.Turn(bones.Rotation, 4 * i);

        private Vector3 Scale(int i) => Turns.Vector(bones.Scale, 3 * i);
    }
}
