using System;
using System.Collections.Generic;
using System.Linq;

namespace AvatarExport.Core {
    /// <summary>What an expression or an eyelid adds to a few vertices of the proxy mesh at weight 1.</summary>
    public sealed class Morph {
        /// <summary>Of the expression or eyelid.</summary>
        public string Name;

        /// <summary>Rising.</summary>
        public int[] Vertices;

        /// <summary>Three for each of Vertices, metres.</summary>
        public float[] Deltas;
    }

    /// <summary>
    /// The mesh that moves the Gaussians, in the frame of the pack, for what an engine does with a mesh: shadows, picking,
    /// a picture without compute. It is not all that the kernels do: pose correctives are missing, a vertex keeps its four
    /// largest bones, and eyelids are added before skinning.
    /// </summary>
    public sealed class ProxyMesh {
        /// <summary>Bones of a vertex.</summary>
        public const int Bones = 4;

        /// <summary>[V, 3] at rest, metres.</summary>
        public float[] Positions;

        /// <summary>[F, 3] vertices.</summary>
        public int[] Triangles;

        /// <summary>Expressions, then eyelids, also those that move nothing.</summary>
        public Morph[] Morphs;

        /// <summary>[V, 4] joints of the skeleton, the largest weight first; 0 where there are fewer.</summary>
        public int[] BoneIndices;

        /// <summary>[V, 4] weights that add up to 1.</summary>
        public float[] BoneWeights;

        /// <summary>The proxy of an avatar; null without a rig. Throws AvatarError for one that does not fit.</summary>
        public static ProxyMesh From(LoadedAvatar avatar) {
            MeshPass[] morph = MeshPass.All(avatar.Program, "morph", "MorphStatic");
            MeshPass[] skin = MeshPass.All(avatar.Program, "skin", "SkinStatic");
            if (avatar.Skeleton == null || morph.Length == 0) return null;
            int vertices = morph[0].Vertices;
            if (skin.Any(one => one.First + one.Count > vertices)) {
                throw new AvatarError("more vertices are skinned than there are", avatar.Name, "proxy");
            }
            ProxyMesh made = new ProxyMesh {
                Positions = new float[3 * vertices],
                Triangles = TrianglesOf(avatar, vertices),
                BoneIndices = new int[Bones * vertices],
                BoneWeights = new float[Bones * vertices],
            };
            foreach (MeshPass one in morph) {
                for (int i = 0; i < 3 * one.Count; i++) made.Positions[3 * one.First + i] = one.Template(i / 3, i % 3);
            }
            foreach (MeshPass one in skin) made.TakeBones(one);
            made.Morphs = MorphsOf(avatar.Expressions.Select(one => one.Name).ToArray(), morph, "morph")
                .Concat(MorphsOf(avatar.Eyelids, skin, "late")).ToArray();
            return made;
        }

        /// <summary>The rig's triangles, or those in which Gaussians are embedded, from corners [3, F].</summary>
        private static int[] TrianglesOf(LoadedAvatar avatar, int vertices) {
            uint[] corners = avatar.Triangles;
            Pass pass = avatar.Program.Levels[0].Deform.FirstOrDefault(one => one.Entry == "bind_triangles");
            if (corners == null && pass != null) {
                Elements held = avatar.Program.Buffers[pass.Buffers["SurfaceStatic"]].Find("corners").Elements;
                corners = Enumerable.Range(0, held.Length).Select(i => held[i]).ToArray();
            }
            if (corners == null) return new int[0];
            if (corners.Any(vertex => vertex >= vertices)) {
                throw new AvatarError("a triangle has a corner that is no vertex of the mesh", avatar.Name, "proxy");
            }
            int count = corners.Length / 3;
            return Enumerable.Range(0, 3 * count).Select(i => (int)corners[i % 3 * count + i / 3]).ToArray();
        }

        private static IEnumerable<Morph> MorphsOf(string[] names, MeshPass[] passes, string part) {
            List<int>[] vertices = names.Select(_ => new List<int>()).ToArray();
            List<float>[] deltas = names.Select(_ => new List<float>()).ToArray();
            foreach (MeshPass pass in passes) {
                SparseRows rows = pass.Rows(part, "_position", 3);
                for (int row = 0; row < pass.Count; row++) {
                    for (int entry = rows.First(row); entry < rows.First(row + 1); entry++) {
                        int column = rows.Column(entry);
                        vertices[column].Add(pass.First + row);
                        for (int c = 0; c < 3; c++) deltas[column].Add(rows.Value(entry, c));
                    }
                }
            }
            return names.Select((name, i) => new Morph {
                Name = name,
                Vertices = vertices[i].ToArray(),
                Deltas = deltas[i].ToArray(),
            });
        }

        /// <summary>The four largest weights of each vertex of a pass; of equal ones the first.</summary>
        private void TakeBones(MeshPass pass) {
            SparseRows rows = pass.Rows("skin", "_weight", 1);
            for (int row = 0; row < pass.Count; row++) {
                int begin = Bones * (pass.First + row);
                for (int entry = rows.First(row); entry < rows.First(row + 1); entry++) {
                    Insert(begin, rows.Column(entry), rows.Value(entry, 0));
                }
                float sum = 0;
                for (int b = 0; b < Bones; b++) sum += BoneWeights[begin + b];
                if (!(sum > 0)) BoneWeights[begin] = sum = 1;
                for (int b = 0; b < Bones; b++) BoneWeights[begin + b] /= sum;
            }
        }

        private void Insert(int begin, int joint, float weight) {
            int at = Bones;
            while (at > 0 && weight > BoneWeights[begin + at - 1]) at--;
            if (at == Bones) return;
            for (int b = Bones - 1; b > at; b--) {
                BoneWeights[begin + b] = BoneWeights[begin + b - 1];
                BoneIndices[begin + b] = BoneIndices[begin + b - 1];
            }
            BoneWeights[begin + at] = weight;
            BoneIndices[begin + at] = joint;
        }
    }
}
