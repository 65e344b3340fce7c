using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>An expression: a blendshape weight that a pose sets.</summary>
    public sealed class Expression {
        /// <summary>The name that poses use.</summary>
        public string Name;

        /// <summary>Other names of it.</summary>
        public string[] Aliases;

        /// <summary>Where its trained range begins.</summary>
        public double Low;

        /// <summary>Where its trained range ends.</summary>
        public double High;
    }

    /// <summary>Skeleton at rest. Matrices are row-major 4x4 for column vectors, float64 as stage joints computes.</summary>
    public sealed class Skeleton {
        /// <summary>[J], a parent before its children.</summary>
        public string[] Names;

        /// <summary>[J], -1 for a root.</summary>
        public int[] Parents;

        /// <summary>[J, 4, 4] parent from joint.</summary>
        public double[] RestLocal;

        /// <summary>[J, 4, 4] joint from mesh.</summary>
        public double[] InverseBindMatrix;

        /// <summary>[K, J, 3] how far each expression moves each joint at rest, metres.</summary>
        public double[] JointBasis;

        /// <summary>[C] joints whose rotation gives nine pose features each.</summary>
        public uint[] CorrectiveJoints;

        /// <summary>[A] vertices that groups of binding "anchor" follow, repeats kept.</summary>
        public uint[] AnchorVertices;
    }

    /// <summary>A group of Gaussians with one binding.</summary>
    public sealed class SplatGroup {
        /// <summary>What it shows: "face", "lower_teeth".</summary>
        public string Name;

        /// <summary>Its first Gaussian.</summary>
        public int First;

        /// <summary>How many Gaussians it has.</summary>
        public int Count;

        /// <summary>"skin", "anchor", "joint_mix", "surface" or "none".</summary>
        public string Binding;

        /// <summary>Joints and their factors; none unless the binding is "joint_mix".</summary>
        public KeyValuePair<string, double>[] JointMix;
    }

    /// <summary>How ARKit inputs drive the avatar: outputs = Matrix inputs, and the joints of measured rotations.</summary>
    public sealed class Driving {
        /// <summary>Names of ARKit's blendshapes, the columns of Matrix.</summary>
        public string[] Inputs;

        /// <summary>"expression/NAME", "eyelid/NAME" or "joint/NAME/x", the rows of Matrix.</summary>
        public string[] Outputs;

        /// <summary>[outputs, inputs]</summary>
        public double[] Matrix;

        /// <summary>The joint that turns with the head; null: the avatar turns as a whole.</summary>
        public string HeadJoint;

        /// <summary>[3] what the head turns around where HeadJoint is null, metres.</summary>
        public double[] HeadPivot;

        /// <summary>The joint of the left eye; or null.</summary>
        public string LeftEyeJoint;

        /// <summary>The joint of the right eye; or null.</summary>
        public string RightEyeJoint;
    }

    /// <summary>What the light of a scene must know of an avatar. Its normals and the light of its capture are in the program.</summary>
    public sealed class Relight {
        /// <summary>Whether the light of its capture moves with it, not with the world.</summary>
        public bool Follows;

        /// <summary>And with this joint, by its index; -1: with none.</summary>
        public int Head = -1;

        /// <summary>[3] the middle of the sphere in which everything lies that casts shadows.</summary>
        public double[] Centre;

        /// <summary>Of that sphere, metres.</summary>
        public double Radius;
    }

    /// <summary>A level of detail as a person sees it.</summary>
    public sealed class LevelInfo {
        /// <summary>How many Gaussians it has.</summary>
        public int Count;

        /// <summary>Instance.HeightPx up to which it is meant; null: any.</summary>
        public double? HeightPx;

        /// <summary>Of its images against the source, inside the mask; null: not measured.</summary>
        public double? PsnrDb;
    }

    /// <summary>A part that a camera may look at, metres.</summary>
    public sealed class FramedPart {
        /// <summary>[3] its middle.</summary>
        public double[] Target;

        /// <summary>[3] width, height, depth.</summary>
        public double[] Size;
    }

    /// <summary>Where to look at rest: the whole avatar or its head.</summary>
    public sealed class Framing {
        /// <summary>[3]</summary>
        public double[] Up;

        /// <summary>[3] the direction in which the avatar looks.</summary>
        public double[] Front;

        /// <summary>The whole avatar.</summary>
        public FramedPart Whole;

        /// <summary>Its head; or null.</summary>
        public FramedPart Head;
    }

    /// <summary>A box, metres.</summary>
    public sealed class BoundingBox {
        /// <summary>[3] the smallest coordinates.</summary>
        public double[] Low;

        /// <summary>[3] the largest coordinates.</summary>
        public double[] High;
    }

    /// <summary>A loaded and checked pack. Nothing of it is on a GPU yet, and nothing of it changes.</summary>
    public sealed class LoadedAvatar {
        /// <summary>What the pack calls it.</summary>
        public string Name;

        /// <summary>What it may be used for; null: not stated.</summary>
        public string License;

        /// <summary>What the person agreed to; null: not stated.</summary>
        public string Consent;

        /// <summary>Of the frame of all arrays here: "right" or "left".</summary>
        public string Handedness;

        /// <summary>[K] in the order of weights.</summary>
        public Expression[] Expressions;

        /// <summary>[L] names of eyelids, in the order of weights.</summary>
        public string[] Eyelids;

        /// <summary>Null without a rig.</summary>
        public Skeleton Skeleton;

        /// <summary>They cover the Gaussians of the finest level in order.</summary>
        public SplatGroup[] Groups;

        /// <summary>Of the manifest; a value may be null.</summary>
        public Dictionary<string, string> Rules;

        /// <summary>Motions that the pack holds.</summary>
        public Clip[] Clips;

        /// <summary>Null: ARKit cannot drive it.</summary>
        public Driving Driving;

        /// <summary>Null: it takes no light of a scene.</summary>
        public Relight Relight;

        /// <summary>Finest first.</summary>
        public LevelInfo[] Levels;

        /// <summary>Where to look; right-handed for every pack.</summary>
        public Framing Framing;

        /// <summary>Over all poses, right-handed for every pack; or null.</summary>
        public BoundingBox Bounds;

        /// <summary>[3] of training, as displayed; null: random.</summary>
        public double[] Background;

        /// <summary>A picture, WebP; or null.</summary>
        public byte[] Preview;

        /// <summary>[3, F] corners of the rig's mesh; null where Gaussians are embedded in it, and without a rig.</summary>
        public uint[] Triangles;

        /// <summary>Of the file.</summary>
        public int Bytes;

        /// <summary>What a GPU runs.</summary>
        public Program Program;

        /// <summary>
        /// The avatar in the bytes of a pack: NAME.avatar, as `avatar-export pack` writes it. `name` is what errors call
        /// it. Throws AvatarError for a file that is no pack, is damaged, cut off or of a newer version, or whose program
        /// would leave its buffers.
        /// </summary>
        public static LoadedAvatar Load(byte[] file, string name = "avatar") {
            try {
                return Pack.Read(file);
            } catch (AvatarError error) {
                throw error.Of(name);
            } catch (OutOfMemoryException) {
                throw new AvatarError("takes more memory than this machine has", name);
            }
        }
    }
}
