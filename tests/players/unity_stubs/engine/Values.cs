// Stands in for Unity in tests: values. Signatures are Unity's; bodies are ours.
using System;

namespace UnityEngine {
    public struct Vector3 {
        public float x, y, z;
        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
        public static Vector3 zero => new Vector3(0, 0, 0);
        public static Vector3 one => new Vector3(1, 1, 1);
        public float magnitude => (float)Math.Sqrt((double)x * x + (double)y * y + (double)z * z);
        public float this[int index] {
            get => index == 0 ? x : index == 1 ? y : z;
            set { if (index == 0) x = value; else if (index == 1) y = value; else z = value; }
        }
        public static Vector3 operator *(Vector3 a, float d) => new Vector3(a.x * d, a.y * d, a.z * d);
        public static Vector3 operator *(float d, Vector3 a) => a * d;
        public static Vector3 operator +(Vector3 a, Vector3 b) => new Vector3(a.x + b.x, a.y + b.y, a.z + b.z);
        public static Vector3 operator -(Vector3 a, Vector3 b) => new Vector3(a.x - b.x, a.y - b.y, a.z - b.z);
        public static bool operator ==(Vector3 lhs, Vector3 rhs) => (lhs - rhs).magnitude < 1e-5f;
        public static bool operator !=(Vector3 lhs, Vector3 rhs) => !(lhs == rhs);
        public override bool Equals(object other) => other is Vector3 && this == (Vector3)other;
        public override int GetHashCode() => 0;
    }

    public struct Vector4 {
        public float x, y, z, w;
        public Vector4(float x, float y, float z, float w) { this.x = x; this.y = y; this.z = z; this.w = w; }
        public static Vector4 zero => new Vector4(0, 0, 0, 0);
    }

    public partial struct Quaternion : IEquatable<Quaternion> {
        public float x, y, z, w;
        public Quaternion(float x, float y, float z, float w) { this.x = x; this.y = y; this.z = z; this.w = w; }
        public static Quaternion identity => new Quaternion(0, 0, 0, 1);
        public float this[int index] => index == 0 ? x : index == 1 ? y : index == 2 ? z : w;
        public bool Equals(Quaternion other) => x == other.x && y == other.y && z == other.z && w == other.w;
        public static Quaternion Inverse(Quaternion rotation) => new Quaternion(-rotation.x, -rotation.y, -rotation.z, rotation.w);
        public static Quaternion operator *(Quaternion a, Quaternion b) {
            return new Quaternion(
                a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y + a.y * b.w + a.z * b.x - a.x * b.z,
                a.w * b.z + a.z * b.w + a.x * b.y - a.y * b.x, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z);
        }
    }

    public struct Matrix4x4 {
        public float m00, m10, m20, m30, m01, m11, m21, m31, m02, m12, m22, m32, m03, m13, m23, m33;
        public static Matrix4x4 identity { get { return new Matrix4x4 { m00 = 1, m11 = 1, m22 = 1, m33 = 1 }; } }
        public float this[int row, int column] { get { return Get(4 * column + row); } set { Set(4 * column + row, value); } }
        public static Matrix4x4 operator *(Matrix4x4 lhs, Matrix4x4 rhs) {
            var made = new Matrix4x4();
            for (int row = 0; row < 4; row++) {
                for (int column = 0; column < 4; column++) {
                    float sum = 0;
                    for (int k = 0; k < 4; k++) sum += lhs[row, k] * rhs[k, column];
                    made[row, column] = sum;
                }
            }
            return made;
        }
        public Vector3 MultiplyPoint3x4(Vector3 point) {
            var made = new Vector3();
            for (int row = 0; row < 3; row++) made[row] = this[row, 0] * point.x + this[row, 1] * point.y + this[row, 2] * point.z + this[row, 3];
            return made;
        }
        public Matrix4x4 inverse => Inverted();

        private float Get(int i) {
            switch (i) {
                case 0: return m00; case 1: return m10; case 2: return m20; case 3: return m30;
                case 4: return m01; case 5: return m11; case 6: return m21; case 7: return m31;
                case 8: return m02; case 9: return m12; case 10: return m22; case 11: return m32;
                case 12: return m03; case 13: return m13; case 14: return m23; default: return m33;
            }
        }

        private void Set(int i, float value) {
            switch (i) {
                case 0: m00 = value; break; case 1: m10 = value; break; case 2: m20 = value; break; case 3: m30 = value; break;
                case 4: m01 = value; break; case 5: m11 = value; break; case 6: m21 = value; break; case 7: m31 = value; break;
                case 8: m02 = value; break; case 9: m12 = value; break; case 10: m22 = value; break; case 11: m32 = value; break;
                case 12: m03 = value; break; case 13: m13 = value; break; case 14: m23 = value; break; default: m33 = value; break;
            }
        }

        /// <summary>Of a rigid matrix.</summary>
        private Matrix4x4 Inverted() {
            Matrix4x4 made = identity;
            for (int r = 0; r < 3; r++) {
                for (int c = 0; c < 3; c++) made[r, c] = this[c, r];
                made[r, 3] = -(m03 * this[0, r] + m13 * this[1, r] + m23 * this[2, r]);
            }
            return made;
        }
    }

    public struct Color {
        public float r, g, b, a;
        public static Color clear => new Color();
        public float this[int index] => index == 0 ? r : index == 1 ? g : index == 2 ? b : a;
    }

    public partial struct Rect {
        public Rect(float x, float y, float width, float height) : this() { this.x = x; this.y = y; this.width = width; this.height = height; }
        public float x { get; set; }
        public float y { get; set; }
        public float width { get; set; }
        public float height { get; set; }
    }

    public struct Bounds {
        public Bounds(Vector3 center, Vector3 size) : this() { this.center = center; this.size = size; }
        public Vector3 center { get; set; }
        public Vector3 size { get; set; }
        public Vector3 extents => size * 0.5f;
        public bool IntersectRay(Ray ray, out float distance) { distance = 0; return false; }
    }

    public struct Ray { }
    public struct Plane { }

    public partial struct Mathf {
        public static float Abs(float f) => Math.Abs(f);
        public static float Max(float a, float b) => Math.Max(a, b);
        public static int Min(int a, int b) => Math.Min(a, b);
        public static float Atan2(float y, float x) => (float)Math.Atan2(y, x);
        public static int RoundToInt(float f) => (int)Math.Round(f);
        public static int CeilToInt(float f) => (int)Math.Ceiling(f);
    }

    public struct BoneWeight {
        public float weight0 { get; set; }
        public float weight1 { get; set; }
        public float weight2 { get; set; }
        public float weight3 { get; set; }
        public int boneIndex0 { get; set; }
        public int boneIndex1 { get; set; }
        public int boneIndex2 { get; set; }
        public int boneIndex3 { get; set; }
    }
}
