using AvatarExport.Core;
using UnityEngine;

namespace AvatarExport {
    /// <summary>
    /// The sources of a pose. For each value the last of these that sets it wins: the clip that the component plays;
    /// blend shapes and bones that were moved, by an Animator, a Timeline or a hand; scripts and the sliders of the
    /// component; live ARKit input. A source that does not set a value leaves it to those before.
    /// </summary>
    internal sealed class PoseLayers {
        private readonly LoadedAvatar avatar;
        private readonly AvatarPose script;
        private readonly PoseMask scripted;
        private readonly AvatarPose live;
        private readonly PoseMask driven;
        private readonly PoseMask above; // what scripts or live input set now
        private readonly PoseNames names;
        private readonly DrivingFrame frame = new DrivingFrame();
        private Driver driver;

        public PoseLayers(LoadedAvatar avatar) {
            this.avatar = avatar;
            script = new AvatarPose(avatar);
            live = new AvatarPose(avatar);
            scripted = new PoseMask(script);
            driven = new PoseMask(script);
            above = new PoseMask(script);
            names = PoseNames.Of(avatar);
        }

        /// <summary>
        /// An expression of scripts. Throws AvatarError for an unknown name or a weight beyond float32.
        /// </summary>
        public void SetExpression(string name, float weight) {
            script.SetExpression(name, weight);
            scripted.Expressions[names.Expressions[name]] = true;
        }

        /// <summary>An eyelid of scripts. Throws AvatarError as SetExpression.</summary>
        public void SetEyelid(string name, float weight) {
            script.SetEyelid(name, weight);
            scripted.Late[names.Eyelids[name]] = true;
        }

        /// <summary>A joint of scripts, as Pose.SetJoint. Throws AvatarError as SetExpression.</summary>
        public void SetJoint(string name, double rx, double ry, double rz) {
            script.SetJoint(name, rx, ry, rz);
            scripted.Joints[names.Joints[name]] = true;
        }

        /// <summary>Scripts set nothing any more.</summary>
        public void ClearScript() {
            script.Reset();
            scripted.Clear();
        }

        /// <summary>Scripts set one expression no more. An unknown name is nothing to clear.</summary>
        public void ClearExpression(string name) {
            int index;
            if (names.Expressions.TryGetValue(name, out index)) scripted.Expressions[index] = false;
        }

        /// <summary>Writes the pose of this frame. "clip", "rig" and "input" may be null.</summary>
        public void Mix(AvatarPose into, Clip clip, double seconds, RigLink rig, ArkitSource input) {
            if (clip != null) clip.Pose(seconds, into);
            else into.Reset();
            bool isLive = input != null && input.isActiveAndEnabled && avatar.Driving != null && input.Read(frame);
            if (isLive) Drive();
            if (rig != null) rig.ReadShapes(into);
            scripted.CopyWeights(script, into);
            if (isLive) driven.CopyWeights(live, into);
            if (rig != null) rig.ReadBones(into);
            scripted.CopyJoints(script, into);
            if (isLive) driven.CopyJoints(live, into);
            // While a scene is edited what is written would be saved with it, and count as moved by a hand ever after.
            if (rig != null && Application.isPlaying) rig.Write(into, Above(isLive));
        }

        private PoseMask Above(bool isLive) {
            for (int i = 0; i < above.Expressions.Length; i++) {
                above.Expressions[i] = scripted.Expressions[i] || isLive && driven.Expressions[i];
            }
            for (int i = 0; i < above.Late.Length; i++) above.Late[i] = scripted.Late[i] || isLive && driven.Late[i];
            for (int i = 0; i < above.Joints.Length; i++) {
                above.Joints[i] = scripted.Joints[i] || isLive && driven.Joints[i];
            }
            above.Root = isLive && driven.Root;
            return above;
        }

        private void Drive() {
            if (driver == null) {
                driver = new Driver(avatar);
                MarkDriven(avatar.Driving);
            }
            driver.Pose(frame, live);
        }

        private void MarkDriven(Driving driving) {
            foreach (string output in driving.Outputs) {
                string[] parts = output.Split('/');
                int index;
                if (parts[0] == "expression" && names.Expressions.TryGetValue(parts[1], out index)) {
                    driven.Expressions[index] = true;
                }
                if (parts[0] == "eyelid" && names.Eyelids.TryGetValue(parts[1], out index)) driven.Late[index] = true;
                if (parts[0] == "joint") MarkJoint(parts[1]);
            }
            MarkJoint(driving.HeadJoint);
            MarkJoint(driving.LeftEyeJoint);
            MarkJoint(driving.RightEyeJoint);
            driven.Root = driving.HeadJoint == null;
        }

        private void MarkJoint(string name) {
            int index;
            if (name != null && names.Joints.TryGetValue(name, out index)) driven.Joints[index] = true;
        }
    }
}
