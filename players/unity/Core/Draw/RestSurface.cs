using System;

namespace AvatarExport.Core {
    /// <summary>Where embedded Gaussians are on the mesh of the binding pose: stage bind without any motion.</summary>
    internal sealed class RestSurface {
        private const double Tiny = 1e-30; // as AVATAR_TINY of bind.hlsli

        private double[] vertices; // [V, 3] metres
        private double[] normals; // [V, 3]; null where the rules need none
        private int[] corners; // [F, 3]
        private PackedPlanes triangleIds, barycentric, displacement, localOffset, localQuat;
        private bool inFrame, turnsWithFrame, unitNormal;
        private readonly double[] frame = new double[12]; // rows four apart, its columns are the axes
        private double size;

        /// <summary>What turns the quaternion that `Place` gave, rows four apart; null if nothing does.</summary>
        internal double[] Turn => turnsWithFrame ? frame : null;

        /// <summary>The mesh and the embedding that pass `bind` of a level reads.</summary>
        internal static RestSurface Of(LoadedAvatar avatar, Level level, Pass bind) {
            Pass triangles = Array.Find(level.Deform, pass => pass.Entry == "bind_triangles");
            int rows = PackedPlanes.Number(bind, "count");
            var words = new PackedWords(avatar.Program.Buffers[bind.Buffers["EmbedStatic"]]);
            var surface = new RestSurface {
                triangleIds = new PackedPlanes(words, bind, "triangle_ids", rows),
                barycentric = new PackedPlanes(words, bind, "barycentric", rows),
                displacement = new PackedPlanes(words, bind, "displacement", rows),
                localOffset = new PackedPlanes(words, bind, "local_offset", rows),
                localQuat = new PackedPlanes(words, bind, "local_quat", rows),
                inFrame = avatar.Rules["position"] == "triangle_frame",
                turnsWithFrame = avatar.Rules["rotation"] == "triangle_frame",
                unitNormal = avatar.Rules["position"] == "normal",
            };
            surface.ReadMesh(avatar, triangles);
            if (!surface.inFrame) surface.SetNormals(bind, level);
            return surface;
        }

        private void ReadMesh(LoadedAvatar avatar, Pass pass) {
            int count = PackedPlanes.Number(pass, "vertices"), faces = PackedPlanes.Number(pass, "triangles");
            var words = new PackedWords(avatar.Program.Buffers[pass.Buffers["SurfaceStatic"]]);
            var canonical = new PackedPlanes(words, pass, "canonical", count);
            var planes = new PackedPlanes(words, pass, "corners", faces);
            vertices = new double[3 * count];
            corners = new int[3 * faces];
            for (int v = 0; v < count; v++) {
                for (int i = 0; i < 3; i++) vertices[3 * v + i] = canonical.Linear(i, v);
            }
            for (int f = 0; f < faces; f++) {
                for (int i = 0; i < 3; i++) corners[3 * f + i] = planes.Code(i, f);
            }
        }

        /// <summary>Sums of the cross products around each vertex, of length 1 unless they are below the floor.</summary>
        private void SetNormals(Pass bind, Level level) {
            Pass pass = Array.Find(level.Deform, one => one.Entry == "bind_vertices");
            double floor = pass.Constants["normal_floor"].Number;
            normals = new double[vertices.Length];
            for (int f = 0; f < corners.Length; f += 3) {
                SetFrame(f / 3, false);
                for (int corner = 0; corner < 3; corner++) {
                    for (int i = 0; i < 3; i++) normals[3 * corners[f + corner] + i] += across[i];
                }
            }
            for (int v = 0; v < normals.Length; v += 3) {
                double length = Math.Max(Length(normals, v), floor);
                for (int i = 0; i < 3; i++) normals[v + i] /= length;
            }
        }

        /// <summary>Position [3] and quaternion [4] (wxyz, any length) of an embedded Gaussian; see `Turn`.</summary>
        internal void Place(int row, double[] position, double[] quaternion) {
            int face = triangleIds.Code(0, row);
            Blend(vertices, face, row, position);
            for (int i = 0; i < 4; i++) quaternion[i] = localQuat.Linear(i, row);
            if (inFrame || turnsWithFrame) SetFrame(face, true);
            if (inFrame) {
                for (int i = 0; i < 3; i++) {
                    double moved = 0;
                    for (int k = 0; k < 3; k++) moved += frame[4 * i + k] * localOffset.Linear(k, row);
                    position[i] += size * moved;
                }
            } else {
                Blend(normals, face, row, normal);
                double length = unitNormal ? Math.Max(Length(normal, 0), Tiny) : 1;
                for (int i = 0; i < 3; i++) position[i] += displacement.Linear(0, row) * normal[i] / length;
            }
        }

        private readonly double[] normal = new double[3];
        private readonly double[] across = new double[3];
        private readonly double[] edge = new double[3];
        private readonly double[] other = new double[3];

        private void Blend(double[] values, int face, int row, double[] result) {
            Array.Clear(result, 0, 3);
            for (int corner = 0; corner < 3; corner++) {
                double weight = barycentric.Linear(corner, row);
                int vertex = 3 * corners[3 * face + corner];
                for (int i = 0; i < 3; i++) result[i] += weight * values[vertex + i];
            }
        }

        /// <summary>`across`, the cross product of two edges; and if asked frame and size as triangle_by_edge of bind.hlsli.</summary>
        private void SetFrame(int face, bool whole) {
            int a = 3 * corners[3 * face], b = 3 * corners[3 * face + 1], c = 3 * corners[3 * face + 2];
            for (int i = 0; i < 3; i++) {
                edge[i] = vertices[b + i] - vertices[a + i];
                other[i] = vertices[c + i] - vertices[a + i];
            }
            Cross(edge, other, across);
            if (!whole) return;
            double first = Math.Max(Length(edge, 0), Tiny), second = Math.Max(Length(across, 0), Tiny), along = 0;
            for (int i = 0; i < 3; i++) {
                frame[4 * i] = edge[i] / first;
                frame[4 * i + 1] = across[i] / second;
            }
            for (int i = 0; i < 3; i++) { // the third axis is -(second x first)
                int j = (i + 1) % 3, k = (i + 2) % 3;
                frame[4 * i + 2] = frame[4 * k + 1] * frame[4 * j] - frame[4 * j + 1] * frame[4 * k];
                along += frame[4 * i + 2] * other[i];
            }
            size = (first + Math.Abs(along)) / 2;
        }

        private static void Cross(double[] a, double[] b, double[] result) {
            result[0] = a[1] * b[2] - a[2] * b[1];
            result[1] = a[2] * b[0] - a[0] * b[2];
            result[2] = a[0] * b[1] - a[1] * b[0];
        }

        private static double Length(double[] v, int at) {
            return Math.Sqrt(v[at] * v[at] + v[at + 1] * v[at + 1] + v[at + 2] * v[at + 2]);
        }
    }
}
