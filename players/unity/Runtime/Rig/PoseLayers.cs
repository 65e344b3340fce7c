using System;
using System.Collections.Generic;
using UnityEngine;

namespace AvatarExport
{
    /// <summary>
    /// The sources of a pose. For each value the last of these that sets it wins: the clip that the component plays;
    /// blend shapes and bones that were moved, by an Animator, a Timeline or a hand; scripts and the sliders of the
    /// component; live ARKit input. A source that does not set a value leaves it to those before.
    /// </summary>
    internal sealed class PoseLayers
    {
        private readonly Core.Avatar avatar;
        private readonly Core.Pose script;
        private readonly PoseMask scripted;
        private readonly Core.Pose live;
        private readonly PoseMask driven;
        private readonly PoseMask above; // what scripts or live input set now
        private readonly Dictionary<string, int> expressions = new Dictionary<string, int>(StringComparer.Ordinal);
        private readonly Dictionary<string, int> late = new Dictionary<string, int>(StringComparer.Ordinal);
        private readonly Dictionary<string, int> joints = new Dictionary<string, int>(StringComparer.Ordinal);
        private readonly Core.DrivingFrame frame = new Core.DrivingFrame();
        private Core.Driver driver;

        public PoseLayers(Core.Avatar avatar)
        {
            this.avatar = avatar;
            script = new Core.Pose(avatar);
            live = new Core.Pose(avatar);
            scripted = new PoseMask(script);
            driven = new PoseMask(script);
            above = new PoseMask(script);
            for (int i = 0; i < avatar.Expressions.Length; i++)
            {
                foreach (string alias in avatar.Expressions[i].Aliases) expressions[alias] = i;
            }
            for (int i = 0; i < avatar.Expressions.Length; i++) expressions[avatar.Expressions[i].Name] = i;
            for (int i = 0; i < avatar.LateMorphs.Length; i++) late[avatar.LateMorphs[i]] = i;
            int count = avatar.Skeleton == null ? 0 : avatar.Skeleton.Names.Length;
            for (int i = 0; i < count; i++) joints[avatar.Skeleton.Names[i]] = i;
        }

        /// <summary>
        /// An expression of scripts. Throws AvatarError for an unknown name or a weight beyond float32.
        /// </summary>
        public void SetExpression(string name, float weight)
        {
            script.SetExpression(name, weight);
            scripted.Expressions[expressions[name]] = true;
        }

        /// <summary>An eyelid of scripts. Throws AvatarError as SetExpression.</summary>
        public void SetEyelid(string name, float weight)
        {
            script.SetEyelid(name, weight);
            scripted.Late[late[name]] = true;
        }

        /// <summary>
        /// A joint of scripts, as Core.Pose.SetJoint. Throws AvatarError as SetExpression.
        /// </summary>
        public void SetJoint(string name, double rx, double ry, double rz)
        {
            script.SetJoint(name, rx, ry, rz);
            scripted.Joints[joints[name]] = true;
        }

        /// <summary>Scripts set nothing any more.</summary>
        public void ClearScript()
        {
            script.Reset();
            scripted.Clear();
        }

        /// <summary>Scripts set one expression no more. An unknown name is nothing to clear.</summary>
        public void ClearExpression(string name)
        {
            int index;
            if (expressions.TryGetValue(name, out index)) scripted.Expressions[index] = false;
        }

        /// <summary>Writes the pose of this frame. "clip", "rig" and "input" may be null.</summary>
        public void Mix(Core.Pose into, Core.Clip clip, double seconds, RigLink rig, ArkitSource input)
        {
            if (clip != null) clip.Sample(seconds, into);
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

        private PoseMask Above(bool isLive)
        {
            for (int i = 0; i < above.Expressions.Length; i++)
            {
                above.Expressions[i] = scripted.Expressions[i] || isLive && driven.Expressions[i];
            }
            for (int i = 0; i < above.Late.Length; i++) above.Late[i] = scripted.Late[i] || isLive && driven.Late[i];
            for (int i = 0; i < above.Joints.Length; i++)
            {
                above.Joints[i] = scripted.Joints[i] || isLive && driven.Joints[i];
            }
            above.Root = isLive && driven.Root;
            return above;
        }

        private void Drive()
        {
            if (driver == null)
            {
                driver = new Core.Driver(avatar);
                MarkDriven(avatar.Driving);
            }
            driver.Pose(frame, live);
        }

        private void MarkDriven(Core.Driving driving)
        {
            foreach (string output in driving.Outputs)
            {
                string[] parts = output.Split('/');
                int index;
                if (parts[0] == "expression" && expressions.TryGetValue(parts[1], out index))
                {
                    driven.Expressions[index] = true;
                }
                if (parts[0] == "eyelid" && late.TryGetValue(parts[1], out index)) driven.Late[index] = true;
                if (parts[0] == "joint") MarkJoint(parts[1]);
            }
            MarkJoint(driving.HeadJoint);
            MarkJoint(driving.LeftEyeJoint);
            MarkJoint(driving.RightEyeJoint);
            driven.Root = driving.HeadJoint == null;
        }

        private void MarkJoint(string name)
        {
            int index;
            if (name != null && joints.TryGetValue(name, out index)) driven.Joints[index] = true;
        }
    }
}
