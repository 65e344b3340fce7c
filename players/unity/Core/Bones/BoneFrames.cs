using System;

namespace AvatarExport.Core {
    /// <summary>
    /// Poses as an engine's bones, and bones as poses. A bone holds translation, rotation and scale; the shear that a
    /// pose may have is lost on the way to bones, and nothing on the way back. Rest joints that expressions move, and
    /// rest transforms with scale, are taken up by the local transforms. Bones are in a left-handed frame: those of a
    /// right-handed avatar have x negated. Methods allocate nothing, but for their errors.
    /// </summary>
    public sealed class BoneFrames {
        private readonly Skeleton skeleton;
        private readonly Chain chain;
        private readonly bool restsBound;
        private readonly bool mirrored;
        private readonly double[] bind; // [J, 3, 4] mesh from bone in the bind pose, rigid
        private readonly double[] toJoint; // [J, 3, 4] bind^-1 inverse_bind^-1: joint from bone, but for moved rest joints
        private readonly double[] toDelta; // [J, 3, 4] inverse linear part of parent bone from joint at rest
        private readonly double[] shown; // [J, 3, 4] mesh from bone as the engine has it
        private readonly double[] local = new double[12];
        private readonly double[] turn = new double[12];
        private readonly double[] step = new double[12];
        private readonly double[] joint = new double[12];
        private readonly double[] parentJoint = new double[12];
        private readonly double[] still = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0 };
        private readonly double[] quat = new double[4];
        private readonly NearestRotation nearest = new NearestRotation();

        /// <summary>
        /// The bones of an avatar. Throws AvatarError without a rig, and for a joint whose rest transform does not fit
        /// float32.
        /// </summary>
        public BoneFrames(LoadedAvatar avatar) {
            skeleton = avatar.Skeleton;
            if (skeleton == null) {
                throw new AvatarError("this avatar has no rig, so an engine cannot pose it", avatar.Name, "rig");
            }
            mirrored = avatar.Handedness == "right";
            chain = new Chain(skeleton);
            restsBound = BoneBinds.RestsBound(skeleton);
            bind = BoneBinds.Of(skeleton);
            toJoint = new double[bind.Length];
            double[] fromBind = BoneBinds.Inverses(RestPose.Rows(skeleton.InverseBindMatrix));
            double[] inverse = BoneBinds.Inverses(bind);
            for (int at = 0; at < bind.Length; at += 12) Affine.Multiply(toJoint, at, inverse, at, fromBind, at);
            toDelta = ToDelta();
            shown = new double[bind.Length];
        }

        /// <summary>
        /// Mesh from bone in the bind pose, [J, 4, 4] row-major, in the engine's frame: a bind pose is its inverse.
        /// </summary>
        public double[] Binds() {
            var found = new double[bind.Length / 3 * 4];
            for (int at = 0, to = 0; at < bind.Length; at += 12, to += 16) {
                for (int k = 0; k < 12; k++) found[to + k] = Sign(k) * bind[at + k];
                found[to + 15] = 1;
            }
            return found;
        }

        /// <summary>
        /// The bones of no pose. Where the rig rests in its binding pose they are free of the rounding of float32
        /// inverse bind matrices.
        /// </summary>
        public void Rest(AvatarPose rest, Bones into) {
            if (!restsBound) {
                ToBones(rest, into);
                return;
            }
            for (int j = 0; j < skeleton.Parents.Length; j++) {
                Array.Copy(bind, 12 * j, local, 0, 12);
                Split(j, into);
            }
        }

        /// <summary>
        /// Writes the bones of a pose of this avatar: each comes as near to the pose as its parent allows, and a child
        /// corrects the error that its parent leaves. Throws AvatarError for a joint whose bone does not fit float32.
        /// </summary>
        public void ToBones(AvatarPose pose, Bones into) {
            chain.Update(pose.ExpressionWeights, pose.JointDelta);
            for (int j = 0; j < skeleton.Parents.Length; j++) {
                Affine.Multiply(local, 0, chain.Skin, 12 * j, bind, 12 * j);
                Split(j, into);
            }
        }

        /// <summary>
        /// Writes the JointDelta of "into" that shows the bones, with the ExpressionWeights that it already has: they
        /// move rest joints. Deltas are finite where the bones are.
        /// </summary>
        public void FromBones(Bones bones, AvatarPose into) {
            chain.SetRest(into.ExpressionWeights);
            for (int j = 0; j < skeleton.Parents.Length; j++) {
                SetLocal(j, bones);
                chain.MovedFrom(j, toJoint, bind, joint);
                Affine.Multiply(local, 0, local, 0, joint, 0); // parent bone from joint
                chain.RestStep(j, step); // delta = (parent_bone_from_parent_joint step)^-1 parent_bone_from_joint
                double x = step[3], y = step[7], z = step[11];
                bool root = skeleton.Parents[j] < 0;
                if (!root) chain.MovedFrom(skeleton.Parents[j], toJoint, bind, parentJoint);
                double[] p = root ? still : parentJoint;
                for (int row = 0; row < 12; row += 4) {
                    local[row + 3] -= p[row] * x + p[row + 1] * y + p[row + 2] * z + p[row + 3];
                }
                Affine.Multiply(into.JointDelta, 16 * j, toDelta, 12 * j, local, 0);
            }
        }

        /// <summary>Writes the transform of the pose as a whole: of the object above the bones.</summary>
        public void ToRoot(AvatarPose pose, double[] translation, double[] rotation) {
            nearest.Write(turn, pose.WorldFromAvatar);
            for (int row = 0; row < 3; row++) translation[row] = Sign(4 * row + 3) * pose.WorldFromAvatar[4 * row + 3];
            SetQuat(rotation, 0);
        }

        /// <summary>
        /// Writes WorldFromAvatar of "into": translation [3] metres, rotation a unit quaternion [4] as x, y, z, w.
        /// </summary>
        public void FromRoot(double[] translation, double[] rotation, AvatarPose into) {
            double m = mirrored ? -1 : 1;
            Affine.SetIdentity(into.WorldFromAvatar, 0, 4);
            Affine.SetFromQuat(into.WorldFromAvatar, 0, rotation[3], rotation[0], m * rotation[1], m * rotation[2]);
            for (int row = 0; row < 3; row++) into.WorldFromAvatar[4 * row + 3] = Sign(4 * row + 3) * translation[row];
        }

        private double[] ToDelta() {
            double[] found = RestPose.Rows(skeleton.RestLocal);
            for (int j = 0; j < skeleton.Parents.Length; j++) {
                int at = 12 * j, parent = skeleton.Parents[j];
                if (parent >= 0) Affine.MultiplyLinear(found, at, toJoint, 12 * parent, found, at);
                Affine.InvertLinear(found, at, found, at);
                found[at + 3] = found[at + 7] = found[at + 11] = 0;
            }
            return found;
        }

        /// <summary>
        /// What element k of a [3, 4] or [4, 4] matrix is multiplied by on its way to the other frame: S M S.
        /// </summary>
        private double Sign(int k) => mirrored && (k < 4) != (k % 4 == 0) ? -1 : 1;

        /// <summary>
        /// Takes "local", mesh from bone as it should be, apart into the bone of joint j, and notes what is shown.
        /// </summary>
        private void Split(int j, Bones into) {
            int parent = skeleton.Parents[j];
            if (parent >= 0) Below(12 * parent);
            for (int k = 0; k < 12; k++) {
                if (Math.Abs(local[k]) <= float.MaxValue) continue;
                string message = "its bone's transform does not fit float32; use smaller numbers in the pose";
                throw new AvatarError(message, null, "joint " + skeleton.Names[j]);
            }
            nearest.Write(turn, local);
            for (int c = 0; c < 3; c++) {
                into.Translation[3 * j + c] = Sign(4 * c + 3) * local[4 * c + 3];
                into.Scale[3 * j + c] = turn[c] * local[c] + turn[4 + c] * local[4 + c] + turn[8 + c] * local[8 + c];
            }
            SetQuat(into.Rotation, 4 * j);
            SetLocal(j, into);
            if (parent >= 0) Affine.Multiply(shown, 12 * j, shown, 12 * parent, local, 0);
            else Array.Copy(local, 0, shown, 12 * j, 12);
        }

        /// <summary>local = shown[parent]^-1 local. A parent of scale 0 has a pseudo-inverse.</summary>
        private void Below(int parent) {
            nearest.Invert(joint, shown, parent);
            for (int row = 0; row < 12; row += 4) local[row + 3] -= shown[parent + row + 3];
            joint[3] = joint[7] = joint[11] = 0;
            Affine.Multiply(local, 0, joint, 0, local, 0);
        }

        /// <summary>
        /// The quaternion of "turn", in the engine's frame; its first component of w, x, y, z that is not 0 is
        /// positive.
        /// </summary>
        private void SetQuat(double[] into, int at) {
            const double Zero = 1e-6;
            Affine.QuatFromMatrix(quat, 0, turn, 0);
            double length = Math.Sqrt(quat[0] * quat[0] + quat[1] * quat[1] + quat[2] * quat[2] + quat[3] * quat[3]);
            if (mirrored) {
                quat[2] = -quat[2];
                quat[3] = -quat[3];
            }
            int first = 0;
            while (first < 3 && !(Math.Abs(quat[first]) > Zero)) first++;
            double scale = (quat[first] < 0 ? -1 : 1) / length;
            for (int k = 0; k < 4; k++) into[at + (k + 3) % 4] = quat[k] * scale;
        }

        /// <summary>local = T R S of bone j, in the pack's frame.</summary>
        private void SetLocal(int j, Bones bones) {
            double m = mirrored ? -1 : 1;
            double[] r = bones.Rotation;
            Affine.SetFromQuat(local, 0, r[4 * j + 3], r[4 * j], m * r[4 * j + 1], m * r[4 * j + 2]);
            for (int row = 0; row < 3; row++) {
                for (int column = 0; column < 3; column++) local[4 * row + column] *= bones.Scale[3 * j + column];
                local[4 * row + 3] = Sign(4 * row + 3) * bones.Translation[3 * j + row];
            }
        }
    }
}
