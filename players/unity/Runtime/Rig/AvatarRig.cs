using System;
using System.Collections.Generic;
using AvatarExport.Core;
using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport {
    /// <summary>
    /// The objects below an avatar: "Rig", which moves with the whole avatar; below it "Proxy", a SkinnedMeshRenderer
    /// with a blend shape for each expression and eyelid; and a Transform for each joint, named as the joint.
    /// </summary>
    public static class AvatarRig {
        /// <summary>Name of the object above the proxy and the bones.</summary>
        public const string RootName = "Rig";

        /// <summary>Name of the object of the SkinnedMeshRenderer.</summary>
        public const string ProxyName = "Proxy";

        /// <summary>Path of the SkinnedMeshRenderer below an avatar: for animation curves "blendShape.NAME".</summary>
        public const string ProxyPath = RootName + "/" + ProxyName;

        private const int Most16Bit = 65535; // vertices

        /// <summary>
        /// The mesh that moves an avatar's splats, in Unity's frame, with a blend shape for each expression, then each
        /// eyelid. An avatar without a rig has a mesh of one point, so that its blend shapes can be animated.
        /// </summary>
        public static Mesh MakeMesh(LoadedAvatar avatar) {
            ProxyMesh proxy = ProxyMesh.From(avatar) ?? Point(avatar);
            bool mirror = avatar.Handedness == "right";
            int count = proxy.Positions.Length / 3;
            var mesh = new Mesh { name = avatar.Name + " proxy" };
            mesh.indexFormat = count > Most16Bit ? IndexFormat.UInt32 : IndexFormat.UInt16;
            mesh.vertices = Vectors(proxy.Positions, mirror);
            mesh.triangles = mirror ? Turned(proxy.Triangles) : proxy.Triangles;
            var deltas = new Vector3[count];
            var names = new HashSet<string>(); // an eyelid may have the name of an expression; blend shapes may not
            foreach (Morph morph in proxy.Morphs) {
                string shape = morph.Name;
                for (int copy = 2; !names.Add(shape); copy++) shape = morph.Name + "_" + copy;
                Array.Clear(deltas, 0, count);
                for (int i = 0; i < morph.Vertices.Length; i++) deltas[morph.Vertices[i]] = VectorAt(morph.Deltas, i, mirror);
                mesh.AddBlendShapeFrame(shape, 100, deltas, null, null);
            }
            if (avatar.Skeleton != null) {
                mesh.boneWeights = Weights(proxy);
                mesh.bindposes = BindPoses(avatar);
            }
            mesh.RecalculateNormals();
            mesh.RecalculateBounds();
            return mesh;
        }

        /// <summary>
        /// Makes the objects below "owner", with "mesh" from MakeMesh. "flags" are those of all objects. The bones are
        /// returned in the order of Skeleton.Names; without a rig there are none.
        /// </summary>
        public static Transform[] Build(Transform owner, LoadedAvatar avatar, Mesh mesh, HideFlags flags,
            out SkinnedMeshRenderer proxy) {
            Transform root = Child(owner, RootName, flags);
            Transform[] bones = Bones(root, avatar, flags);
            Transform holder = Child(root, ProxyName, flags);
            proxy = holder.gameObject.AddComponent<SkinnedMeshRenderer>();
            proxy.sharedMesh = mesh;
            proxy.bones = bones;
            if (bones.Length > 0) proxy.rootBone = root;
            proxy.localBounds = LocalBounds(avatar);
            proxy.enabled = false;
            return bones;
        }

        /// <summary>Paths of the bones below an avatar, in the order of Skeleton.Names: for animation curves.</summary>
        public static string[] BonePaths(LoadedAvatar avatar) {
            if (avatar.Skeleton == null) return new string[0];
            var made = new string[avatar.Skeleton.Names.Length];
            for (int i = 0; i < made.Length; i++) {
                int parent = avatar.Skeleton.Parents[i];
                made[i] = (parent < 0 ? RootName : made[parent]) + "/" + BoneName(avatar, i);
            }
            return made;
        }

        /// <summary>The box of an avatar over all its poses, in the object's own space, metres.</summary>
        public static Bounds LocalBounds(LoadedAvatar avatar) {
            double[] low, high;
            if (avatar.Bounds != null) {
                low = avatar.Bounds.Low;
                high = avatar.Bounds.High;
            } else {
                // No poses were measured: as far to every side as the avatar is large at rest.
                FramedPart whole = avatar.Framing.Whole;
                low = new double[3];
                high = new double[3];
                for (int i = 0; i < 3; i++) {
                    low[i] = whole.Target[i] - whole.Size[i];
                    high[i] = whole.Target[i] + whole.Size[i];
                }
            }
            Vector3 centre = Vector3.zero, size = Vector3.zero;
            for (int i = 0; i < 3; i++) {
                centre[i] = (i == 0 ? -1 : 1) * (float)(low[i] + high[i]) / 2; // Unity is left-handed
                size[i] = (float)(high[i] - low[i]);
            }
            return new Bounds(centre, size);
        }

        private static Transform[] Bones(Transform root, LoadedAvatar avatar, HideFlags flags) {
            if (avatar.Skeleton == null) return new Transform[0];
            string[] names = avatar.Skeleton.Names;
            var made = new Transform[names.Length];
            var rest = new Bones(names.Length);
            new BoneFrames(avatar).Rest(new AvatarPose(avatar), rest);
            for (int i = 0; i < names.Length; i++) {
                int parent = avatar.Skeleton.Parents[i];
                made[i] = Child(parent < 0 ? root : made[parent], BoneName(avatar, i), flags);
                made[i].localPosition = Turns.Vector(rest.Translation, 3 * i);
                made[i].localRotation = Turns.Turn(rest.Rotation, 4 * i);
                made[i].localScale = Turns.Vector(rest.Scale, 3 * i);
            }
            return made;
        }

        /// <summary>A slash would divide the path of an animation curve.</summary>
        private static string BoneName(LoadedAvatar avatar, int joint) {
            return avatar.Skeleton.Names[joint].Replace('/', '_');
        }

        private static Transform Child(Transform parent, string name, HideFlags flags) {
            var made = new GameObject(name) { hideFlags = flags };
            made.transform.SetParent(parent, false);
            return made.transform;
        }

        private static ProxyMesh Point(LoadedAvatar avatar) {
            var morphs = new Morph[avatar.Expressions.Length + avatar.Eyelids.Length];
            for (int i = 0; i < morphs.Length; i++) {
                int late = i - avatar.Expressions.Length;
                string name = late < 0 ? avatar.Expressions[i].Name : avatar.Eyelids[late];
                morphs[i] = new Morph { Name = name, Vertices = new int[0], Deltas = new float[0] };
            }
            return new ProxyMesh {
                Positions = new float[9], Triangles = new[] { 0, 1, 2 }, Morphs = morphs, BoneIndices = new int[12],
                    BoneWeights = new float[12],
            };
        }

        private static Vector3[] Vectors(float[] values, bool mirror) {
            var made = new Vector3[values.Length / 3];
            for (int i = 0; i < made.Length; i++) made[i] = VectorAt(values, i, mirror);
            return made;
        }

        private static Vector3 VectorAt(float[] values, int i, bool mirror) {
            return new Vector3(mirror ? -values[3 * i] : values[3 * i], values[3 * i + 1], values[3 * i + 2]);
        }

        private static int[] Turned(int[] triangles) {
            var made = new int[triangles.Length];
            for (int i = 0; i < made.Length; i += 3) {
                made[i] = triangles[i];
                made[i + 1] = triangles[i + 2];
                made[i + 2] = triangles[i + 1];
            }
            return made;
        }

        private static BoneWeight[] Weights(ProxyMesh proxy) {
            var made = new BoneWeight[proxy.Positions.Length / 3];
            int[] bones = proxy.BoneIndices;
            float[] weights = proxy.BoneWeights;
            for (int i = 0; i < made.Length; i++) {
                made[i] = new BoneWeight {
                    boneIndex0 = bones[4 * i], boneIndex1 = bones[4 * i + 1], boneIndex2 = bones[4 * i + 2],
                        boneIndex3 = bones[4 * i + 3],
                    weight0 = weights[4 * i], weight1 = weights[4 * i + 1], weight2 = weights[4 * i + 2],
                        weight3 = weights[4 * i + 3],
                };
            }
            return made;
        }

        private static Matrix4x4[] BindPoses(LoadedAvatar avatar) {
            double[] binds = new BoneFrames(avatar).Binds();
            var made = new Matrix4x4[binds.Length / 16];
            for (int i = 0; i < made.Length; i++) {
                Matrix4x4 bind = Matrix4x4.identity;
                for (int k = 0; k < 16; k++) bind[k / 4, k % 4] = (float)binds[16 * i + k];
                made[i] = bind.inverse;
            }
            return made;
        }
    }
}
