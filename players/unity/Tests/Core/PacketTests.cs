using System;
using System.IO;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>Live Link Face packets: taken and refused as Python does, and never an exception.</summary>
    public sealed class PacketTests {
        [Test]
        public void RecordedAndChangedPacketsAreTakenAsPythonTakesThem() {
            int taken = 0, refused = 0;
            DrivingFrame frame = new DrivingFrame(), want = new DrivingFrame();
            using (var cases = new BinaryReader(new MemoryStream(Cases.Bytes("packets.bin")))) {
                while (cases.BaseStream.Position < cases.BaseStream.Length) {
                    int length = cases.ReadInt32();
                    byte[] packet = cases.ReadBytes(length).Concat(new byte[7]).ToArray(); // a buffer is larger
                    bool sound = cases.ReadByte() == 1;
                    string what = "packet " + (taken + refused);
                    Assert.AreEqual(sound, LiveLinkPacket.Read(packet, length, frame), what);
                    taken += sound ? 1 : 0;
                    refused += sound ? 0 : 1;
                    if (sound) want.SetChannels(Enumerable.Range(0, 61).Select(_ => cases.ReadDouble()).ToArray(), 0);
                    Near.Same(want, frame, what); // one that is refused changes nothing
                }
            }
            Assert.Greater(taken, 50);
            Assert.Greater(refused, 500);
        }

        [Test]
        public void NonsenseIsRefused() {
            var frame = new DrivingFrame();
            var random = new Random(17);
            var noise = new byte[320];
            Assert.IsFalse(LiveLinkPacket.Read(null, 0, frame));
            foreach (int length in new[] { -1, 0, 1, 2 }) Assert.IsFalse(LiveLinkPacket.Read(new byte[] { 6 }, length, frame));
            for (int i = 0; i < 2000; i++) {
                random.NextBytes(noise);
                noise[0] = 6;
                Array.Clear(noise, 1, random.Next(16));
                Assert.IsFalse(LiveLinkPacket.Read(noise, random.Next(noise.Length + 1), frame));
            }
        }
    }
}
