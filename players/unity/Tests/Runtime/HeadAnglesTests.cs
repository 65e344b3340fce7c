using System;
using NUnit.Framework;
using UnityEngine;

namespace AvatarExport.Tests {
    /// <summary>Angles of a head that ARFoundation sees.</summary>
    public sealed class HeadAnglesTests {
        /// <summary>About an axis of ARKit's frame, as Unity has it: z points the other way, and so do turns about x and y.</summary>
        private static Quaternion Turn(int axis, double angle) {
            float sine = (float)Math.Sin(angle / 2), cosine = (float)Math.Cos(angle / 2);
            return new Quaternion(axis == 0 ? -sine : 0, axis == 1 ? -sine : 0, axis == 2 ? sine : 0, cosine);
        }

        [Test]
        public void YawPitchRollAreFoundAgain() {
            double[] angles = { 0.4, -0.3, 0.2 }, found = new double[3];
            HeadAngles.Write(Turn(1, angles[0]) * Turn(0, -angles[1]) * Turn(2, angles[2]), found);
            for (int i = 0; i < 3; i++) Assert.AreEqual(angles[i], found[i], 1e-6);
        }
    }
}
