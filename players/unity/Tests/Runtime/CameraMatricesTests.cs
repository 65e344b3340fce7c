using AvatarExport.Core;
using System.Linq;
using NUnit.Framework;
using UnityEngine;

namespace AvatarExport.Tests {
    /// <summary>Unity's camera and object matrices as those of the core.</summary>
    public sealed class CameraMatricesTests {
        private const float Near = 0.3f, Far = 50;

        /// <summary>Turned about two axes, and away from the origin; rigid.</summary>
        private static Matrix4x4 View() {
            const float A = 0.8f, B = 0.6f; // cosine, sine
            Matrix4x4 yaw = Matrix4x4.identity, pitch = Matrix4x4.identity;
            yaw.m00 = yaw.m22 = A;
            yaw.m02 = B;
            yaw.m20 = -B;
            pitch.m11 = pitch.m22 = A;
            pitch.m12 = -B;
            pitch.m21 = B;
            Matrix4x4 view = pitch * yaw;
            view.m03 = 0.3f;
            view.m13 = -0.7f;
            view.m23 = -4;
            return view;
        }

        /// <summary>Off-centre, as that of an eye.</summary>
        private static Matrix4x4 Projection() {
            var made = new Matrix4x4 { m00 = 1.5f, m11 = 2, m02 = 0.1f, m12 = -0.05f, m32 = -1 };
            made.m22 = -(Far + Near) / (Far - Near);
            made.m23 = -2 * Far * Near / (Far - Near);
            return made;
        }

        private static double[] Rows(Matrix4x4 m) => Enumerable.Range(0, 16).Select(i => (double)m[i / 4, i % 4]).ToArray();

        [Test]
        public void CameraIsThatOfTheCore() {
            AvatarCamera wanted = new AvatarCamera(), found = new AvatarCamera();
            wanted.FromOpengl(Rows(View()), Rows(Projection()), 640, 480);
            new CameraMatrices().Write(View(), Projection(), false, 640, 480, found);
            for (int i = 0; i < 16; i++) {
                Assert.AreEqual(wanted.CameraFromWorld[i], found.CameraFromWorld[i], 1e-5, "view " + i);
                if (i / 4 != 2) Assert.AreEqual(wanted.ClipFromWorld[i], found.ClipFromWorld[i], 1e-5, "clip " + i);
            }
            for (int i = 0; i < 3; i++) Assert.AreEqual(wanted.Centre[i], found.Centre[i], 1e-5);
            for (int i = 0; i < 2; i++) Assert.AreEqual(wanted.TanHalfFov[i], found.TanHalfFov[i], 1e-6);
            Assert.AreEqual(640, found.Width);
        }

        [TestCase(true)]
        [TestCase(false)]
        public void ClipDepthIsThatOfTheDepthBuffer(bool reversed) {
            var camera = new AvatarCamera();
            new CameraMatrices().Write(Matrix4x4.identity, Projection(), reversed, 8, 8, camera);
            foreach (float depth in new[] { Near, Far }) {
                float[] clip = camera.ClipFromWorld;
                double z = clip[10] * -depth + clip[11], w = clip[14] * -depth + clip[15];
                Assert.AreEqual(depth == Near == reversed ? 1 : 0, z / w, 1e-5);
            }
        }

        [Test]
        public void UnitysWorldIsTheMirrorOfThePersonsAndOrthographicProjectionsAreSeen() {
            Matrix4x4 matrix = View();
            var place = new double[16];
            CameraMatrices.WritePlace(matrix, place);
            Assert.AreEqual(Rows(matrix).Select((m, i) => i % 4 == 0 ? -m : m), place);
            Assert.IsTrue(CameraMatrices.HasPerspective(Projection()));
            Assert.IsFalse(CameraMatrices.HasPerspective(Matrix4x4.identity));
        }
    }
}
