using System;
using System.Collections.Generic;

namespace AvatarExport.Core
{
    /// <summary>
    /// The few vertices of a mesh whose motion moves an "anchor" group: decoded once, posed on the CPU.
    /// </summary>
    internal sealed class Anchors
    {
        /// <summary>Neutral vertices [A, 3].</summary>
        public readonly double[] Rest;

        /// <summary>Posed vertices [A, 3] of the newest Update.</summary>
        public readonly double[] Posed;

        private readonly double[] morphed;
        private readonly MeshEntries morphs;
        private readonly MeshEntries correctives;
        private readonly MeshEntries late;
        private readonly MeshEntries skin;

        /// <summary>
        /// Vertices [A] are decoded from the mesh of a program that has been checked. Throws AvatarError if no pass
        /// poses one.
        /// </summary>
        public Anchors(Program program, uint[] vertices)
        {
            MeshRow[] morphRows = Array.ConvertAll(vertices, one => MeshRow.Of(program, "morph", "MorphStatic", one));
            MeshRow[] skinRows = Array.ConvertAll(vertices, one => MeshRow.Of(program, "skin", "SkinStatic", one));
            Rest = new double[3 * vertices.Length];
            for (int a = 0; a < vertices.Length; a++) morphRows[a].Template(Rest, 3 * a);
            morphed = new double[Rest.Length];
            Posed = (double[])Rest.Clone();
            morphs = MeshEntries.Of(morphRows, "morph", "morph_position");
            correctives = MeshEntries.Of(morphRows, "corrective", "corrective_position");
            late = MeshEntries.Of(skinRows, "late", "late_position");
            skin = MeshEntries.Of(skinRows, "skin", "skin_weight");
        }

        /// <summary>Stages morph and skin: the content of buffer Pose, and skin matrices [J, 3, 4].</summary>
        public void Update(float[] pose, PoseSections at, double[] matrices)
        {
            Array.Copy(Rest, morphed, Rest.Length);
            morphs.AddTo(morphed, pose, at.Weights);
            correctives.AddTo(morphed, pose, at.Features);
            Array.Clear(Posed, 0, Posed.Length);
            for (int e = 0; e < skin.Row.Length; e++)
            {
                int to = 3 * skin.Row[e], m = 12 * skin.Column[e];
                double weight = skin.Value[e], x = morphed[to], y = morphed[to + 1], z = morphed[to + 2];
                for (int c = 0; c < 3; c++, m += 4)
                {
                    Posed[to + c] += weight * (matrices[m] * x + matrices[m + 1] * y + matrices[m + 2] * z + matrices[m + 3]);
                }
            }
            late.AddTo(Posed, pose, at.Late);
        }
    }

    /// <summary>Sparse rows of vertices: entry e adds weights[Column[e]] * Value[e] to vertex Row[e].</summary>
    internal sealed class MeshEntries
    {
        public int[] Row;
        public int[] Column;
        public double[] Value; // [E, channels]

        /// <summary>
        /// The entries of a part of all vertices; values of three channels, or of one for skin weights.
        /// </summary>
        public static MeshEntries Of(MeshRow[] rows, string part, string values)
        {
            var row = new List<int>();
            var column = new List<int>();
            var value = new List<double>();
            for (int a = 0; a < rows.Length; a++)
            {
                Elements pointer = rows[a].Section(part + "_ptr"), columns = rows[a].Section(part + "_column");
                int end = (int)pointer[rows[a].Row + 1];
                for (int e = (int)pointer[rows[a].Row]; e < end; e++)
                {
                    row.Add(a);
                    column.Add((int)columns[e]);
                    rows[a].Decode(values, e, (int)columns[e], value);
                }
            }
            return new MeshEntries { Row = row.ToArray(), Column = column.ToArray(), Value = value.ToArray() };
        }

        /// <summary>Adds what weights[first + column] move to vertices [A, 3].</summary>
        public void AddTo(double[] vertices, float[] weights, int first)
        {
            for (int e = 0; e < Row.Length; e++)
            {
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
