using System.Collections.Generic;
using System.Linq;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>A whole pack: inflated, read, checked.</summary>
    internal static class Pack {
        private static readonly string[] Axes = { "x", "y", "z" };
        private static readonly Form DocumentForm = Form.Parse(PackForm.Text);

        /// <summary>The avatar in the bytes of a pack. Throws AvatarError, which does not know the file's name.</summary>
        public static LoadedAvatar Read(byte[] file) {
            Inflated inflated = new Inflated(file);
            Json document = inflated.Header.Document;
            Versions.Check(document);
            AvatarError fault = DocumentForm.Fault(document);
            if (fault != null) throw fault;
            Versions.CheckShaders(document.At("shaders"));
            Tensors tensors = new Tensors(inflated, file.Length);
            Json said = document.At("program");
            Program program = Programs.Read(said, tensors.Buffers(said.At("buffers")));
            SplatGroup[][] groups = Groups(document.At("levels").List(), program.Levels);
            Checker.Check(program, groups[0].Length, file.Length);
            return ReadAvatar(document, tensors.Arrays(document.At("arrays")), program, groups[0], file.Length);
        }

        private static LoadedAvatar ReadAvatar(
            Json document, Dictionary<string, HeldArray> arrays, Program program, SplatGroup[] groups, int bytes) {
            Json said = document.At("avatar");
            Expression[] expressions = Facts.Expressions(said);
            string[] late = said.At("late_morphs").Names();
            string[] joints = said.Optional("joints", names => names.Names(), null);
            long vertices = VerticesOf(program);
            Skeleton skeleton = joints == null ? null : Rig.Read(arrays, joints, expressions.Length, vertices);
            HashSet<string> known = new HashSet<string>(joints ?? new string[0], NameComparer.Instance);
            CheckPose(program, expressions.Length, late.Length, skeleton);
            Rig.CheckGroups(groups, skeleton, known);
            Dictionary<string, string> rules = Facts.Rules(said);
            CheckRotation(rules, known);
            Driving driving = Facts.Driving(document);
            CheckDriving(driving, expressions, late, known);
            long limit = Inflated.MostOf(bytes);
            string handedness = said.At("frame").At("handedness").Text();
            return new LoadedAvatar {
                Name = said.At("name").Text(),
                License = Statement(said, "licence"),
                Consent = Statement(said, "consent"),
                Handedness = handedness,
                Expressions = expressions,
                Eyelids = late,
                Skeleton = skeleton,
                Groups = groups,
                Rules = rules,
                Clips = Clips.Read(said.At("clips"), arrays, expressions.Length, late.Length, known.Count, limit),
                Driving = driving,
                Relight = Facts.Relight(said, program, joints),
                Levels = Facts.Levels(document),
                Framing = Facts.Framing(document, handedness == "left"),
                Bounds = Facts.Bounds(said, handedness == "left"),
                Background = Facts.Background(said),
                Preview = Preview(arrays),
                Triangles = skeleton == null || program.ReadsMesh ? null : Rig.Triangles(arrays, vertices),
                Bytes = bytes,
                Program = program,
            };
        }

        private static string Statement(Json avatar, string name) {
            return avatar.At("provenance").Optional(name, said => said.Value as string, null);
        }

        private static byte[] Preview(Dictionary<string, HeldArray> arrays) {
            HeldArray held;
            return arrays.TryGetValue("preview", out held) && held.Type == "u8" ? held.Elements.Copied<byte>() : null;
        }

        /// <summary>Vertices of the mesh; 0 if there is none. Its passes have been checked.</summary>
        private static long VerticesOf(Program program) {
            Pass pass = program.Mesh.FirstOrDefault(one => one.Constants.ContainsKey("vertices"));
            return pass == null ? 0 : (long)pass.Constants["vertices"].Number;
        }

        /// <summary>Every level has its own rows and all groups of the finest, since group transforms are shared.</summary>
        private static SplatGroup[][] Groups(Json[] said, Level[] levels) {
            if (said.Length != levels.Length) {
                throw new AvatarError("has another number of levels than $.levels", null, "$.program.levels");
            }
            SplatGroup[][] groups = said.Zip(levels, (one, level) => Facts.Groups(one, level.Chunks.Sum(run => (long)run.Count))).ToArray();
            for (int index = 1; index < groups.Length; index++) {
                if (!groups[index].Select(group => group.Binding).SequenceEqual(groups[0].Select(group => group.Binding))) {
                    throw new AvatarError("has other groups than the finest level", null, said[index].At("groups").Path);
                }
            }
            return groups;
        }

        /// <summary>Sections of Pose have the floats that stage joints gives.</summary>
        private static void CheckPose(Program program, int expressions, int late, Skeleton skeleton) {
            PoseSections pose = program.Pose;
            CheckPoseSection("weights", pose.Features - pose.Weights, expressions);
            CheckPoseSection("late", pose.Joints - pose.Late, late);
            int joints = skeleton == null ? 0 : skeleton.Names.Length;
            CheckPoseSection("joints", program.PoseFloats - pose.Joints, 12 * joints);
            if (skeleton == null) return;
            CheckPoseSection("features", pose.Late - pose.Features, 9 * skeleton.CorrectiveJoints.Length);
        }

        private static void CheckPoseSection(string name, int floats, int needed) {
            if (floats != needed) {
                string line = Invariant($"takes {floats} floats; the avatar's names need {needed}");
                throw new AvatarError(line, null, "$.program.pose." + name);
            }
        }

        private static void CheckRotation(Dictionary<string, string> rules, HashSet<string> joints) {
            const string field = "$.avatar.rules.rotation_joint";
            string rotation, joint;
            rules.TryGetValue("rotation", out rotation);
            rules.TryGetValue("rotation_joint", out joint);
            Rig.CheckJoint(joint, joints, field);
            if (rotation == "head_bone" && joint == null) {
                throw new AvatarError("rule head_bone needs a rotation_joint", null, field);
            }
        }

        private static void CheckDriving(Driving driving, Expression[] expressions, string[] late, HashSet<string> joints) {
            if (driving == null) return;
            HashSet<string> known = new HashSet<string>(NameComparer.Instance);
            known.UnionWith(expressions.Select(one => "expression/" + one.Name));
            known.UnionWith(late.Select(name => "eyelid/" + name));
            known.UnionWith(joints.SelectMany(name => Axes.Select(axis => "joint/" + name + "/" + axis)));
            string unknown = driving.Outputs.FirstOrDefault(output => !known.Contains(output));
            if (unknown != null) {
                string kinds = "' is no expression/NAME, eyelid/NAME or joint/NAME/x|y|z of this avatar";
                throw new AvatarError("'" + Json.Cut(unknown, 80) + kinds, null, "driving.outputs");
            }
            Rig.CheckJoint(driving.HeadJoint, joints, "driving.head_joint");
            Rig.CheckJoint(driving.LeftEyeJoint, joints, "driving.left_eye_joint");
            Rig.CheckJoint(driving.RightEyeJoint, joints, "driving.right_eye_joint");
        }
    }
}
