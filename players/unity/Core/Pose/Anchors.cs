using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>
    /// The few vertices of a mesh whose motion moves an "anchor" group: decoded once, posed on the CPU.
    /// </summary>
    internal sealed class Anchors {
        /// <summary>Neutral vertices [A, 3].</summary>
        public readonly double[] Rest;

        /// <summary>Posed vertices [A, 3] of the newest Update.</summary>
        public readonly double[] Posed;

        private readonly double[] morph;
        private readonly MeshEntries morphs;
        private readonly MeshEntries correctives;
        private readonly MeshEntries late;
        private readonly MeshEntries skin;

        /// <summary>
        /// Vertices [A] are decoded from the mesh of a program that has been checked. Throws AvatarError if no pass
        /// poses one.
        /// </summary>
        public Anchors(Program program, uint[] vertices) {
            MeshPass[] morphed = MeshPass.All(program, "morph", "MorphStatic"), skinned = MeshPass.All(program, "skin", "SkinStatic");
            Rest = new double[3 * vertices.Length];
            for (int i = 0; i < Rest.Length; i++) {
                MeshPass pass = PassOf(morphed, vertices[i / 3]);
                Rest[i] = pass.Template((int)vertices[i / 3] - pass.First, i % 3);
            }
            morph = new double[Rest.Length];
            Posed = (double[])Rest.Clone();
            morphs = new MeshEntries(morphed, vertices, "morph", "_position", 3);
            correctives = new MeshEntries(morphed, vertices, "corrective", "_position", 3);
            late = new MeshEntries(skinned, vertices, "late", "_position", 3);
            skin = new MeshEntries(skinned, vertices, "skin", "_weight", 1);
        }

        /// <summary>The pass that poses a vertex. Throws AvatarError if none does.</summary>
        internal static MeshPass PassOf(MeshPass[] passes, uint vertex) {
            MeshPass found = Array.Find(passes, one => vertex >= one.First && vertex < one.First + one.Count);
            if (found != null) return found;
            string message = $"no pass poses vertex {vertex}, which an anchor group follows";
            throw new AvatarError(message, null, "array rig.anchor_vertices");
        }

        /// <summary>Stages morph and skin: the content of buffer Pose, and skin matrices [J, 3, 4].</summary>
        public void Update(float[] pose, PoseSections at, double[] matrices) {
            Array.Copy(Rest, morph, Rest.Length);
            morphs.AddTo(morph, pose, at.Weights);
            correctives.AddTo(morph, pose, at.Features);
            Array.Clear(Posed, 0, Posed.Length);
            for (int e = 0; e < skin.Row.Length; e++) {
                int to = 3 * skin.Row[e], m = 12 * skin.Column[e];
                double weight = skin.Value[e], x = morph[to], y = morph[to + 1], z = morph[to + 2];
                for (int c = 0; c < 3; c++, m += 4) {
                    Posed[to + c] += weight * (matrices[m] * x + matrices[m + 1] * y + matrices[m + 2] * z + matrices[m + 3]);
                }
            }
            late.AddTo(Posed, pose, at.Late);
        }
    }

    /// <summary>Sparse rows of vertices: entry e adds weights[Column[e]] * Value[e] to vertex Row[e].</summary>
    internal sealed class MeshEntries {
        public readonly int[] Row;
        public readonly int[] Column;
        public readonly double[] Value; // [E, channels]

        /// <summary>The entries of a part of all vertices.</summary>
        public MeshEntries(MeshPass[] passes, uint[] vertices, string part, string values, int channels) {
            var row = new List<int>();
            var column = new List<int>();
            var value = new List<double>();
            for (int a = 0; a < vertices.Length; a++) {
                MeshPass pass = Anchors.PassOf(passes, vertices[a]);
                SparseRows rows = pass.Rows(part, values, channels);
                int own = (int)vertices[a] - pass.First, end = rows.First(own + 1);
                for (int entry = rows.First(own); entry < end; entry++) {
                    row.Add(a);
                    column.Add(rows.Column(entry));
                    for (int c = 0; c < channels; c++) value.Add(rows.Value(entry, c));
                }
            }
            Row = row.ToArray();
            Column = column.ToArray();
            Value = value.ToArray();
        }

        /// <summary>Adds what weights[first + column] move to vertices [A, 3].</summary>
        public void AddTo(double[] vertices, float[] weights, int first) {
            for (int e = 0; e < Row.Length; e++) {
                double weight = weights[first + Column[e]];
                if (weight == 0) continue;
                int at = 3 * Row[e];
                vertices[at] += weight * Value[3 * e];
                vertices[at + 1] += weight * Value[3 * e + 1];
                vertices[at + 2] += weight * Value[3 * e + 2];
            }
        }
    }
}
