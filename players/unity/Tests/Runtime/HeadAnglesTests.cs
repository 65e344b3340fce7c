using System;
using NUnit.Framework;
using UnityEngine;

namespace AvatarExport.Tests
{
    /// <summary>Angles of a head that ARFoundation sees.</summary>
    public sealed class HeadAnglesTests
    {
        /// <summary>
        /// About an axis of ARKit's frame, as Unity has it: z points the other way, and so do turns about x and y.
        /// </summary>
        private static Quaternion Turn(int axis, double angle)
        {
            float sine = (float)Math.Sin(angle / 2), cosine = (float)Math.Cos(angle / 2);
            return new Quaternion(axis == 0 ? -sine : 0, axis == 1 ? -sine : 0, axis == 2 ? sine : 0, cosine);
        }

        [Test]
        public void YawPitchRollAreFoundAgain()
        {
            double yaw = 0.4, pitch = -0.3, roll = 0.2;
            var found = new double[3];
            HeadAngles.Write(Turn(1, yaw) * Turn(0, -pitch) * Turn(2, roll), found);
            Assert.AreEqual(yaw, found[0], 1e-6);
            Assert.AreEqual(pitch, found[1], 1e-6);
            Assert.AreEqual(roll, found[2], 1e-6);
        }
    }
}
