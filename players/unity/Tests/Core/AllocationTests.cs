using System;
using System.Linq;
using System.Text;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests
{
    /// <summary>A frame allocates nothing: 51 expressions that move joints, 262 joints, anchors.</summary>
    [TestFixture]
    public sealed class AllocationTests
    {
        private const int Frames = 50;

        [Test]
        public void AFrameAllocatesNothing()
        {
            Core.Avatar avatar = Pack.Read(Cases.Bytes("wide", "pack.avatar"), "wide");
            Assert.AreEqual(51, avatar.Expressions.Length);
            Assert.AreEqual(262, avatar.Skeleton.Names.Length);
            var frame = new WideFrame(avatar, Cases.Bytes("packets.bin"), Encoding.UTF8.GetString(Cases.Bytes("recording.csv")));
            for (int i = 0; i < 3; i++) frame.Play(i); // until everything is compiled
            Func<long> allocated = Counter();
            long before = allocated();
            for (int i = 0; i < Frames; i++) frame.Play(i);
            long grown = allocated() - before;
            Assert.AreEqual(0, grown, "bytes of " + Frames + " frames");
            frame.Keep(); // the counter counts
            Assert.Greater(allocated() - before, 999);
        }

        /// <summary>Bytes that this thread has allocated. Not every runtime that Unity has tells them.</summary>
        private static Func<long> Counter()
        {
            System.Reflection.MethodInfo found = typeof(GC).GetMethod("GetAllocatedBytesForCurrentThread");
            if (found == null) Assert.Ignore("this runtime does not tell what was allocated");
            return (Func<long>)Delegate.CreateDelegate(typeof(Func<long>), found);
        }

        /// <summary>Everything that a frame may do.</summary>
        private sealed class WideFrame
        {
            private readonly Instance instance;
            private readonly Driver driver;
            private readonly Clip clip;
            private readonly Recording recording;
            private readonly BoneFrames frames;
            private readonly Bones bones;
            private readonly PassList[] lists;
            private readonly byte[] packet;
            private readonly DrivingFrame driving = new DrivingFrame();
            private readonly Core.Camera camera = new Core.Camera();
            private readonly double[] target = new double[3];
            private readonly double[] translation = new double[3];
            private readonly double[] rotation = new double[4];
            private readonly double[] view = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1, 0, 0, 0, 1 };
            private readonly double[] projection = { 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, -1, -0.1, 0, 0, -1, 0 };
            private readonly string joint;
            private object kept;

            public WideFrame(Core.Avatar avatar, byte[] packets, string csv)
            {
                instance = new Instance(avatar, 0);
                driver = new Driver(avatar, true);
                clip = new Clip(avatar, 0);
                recording = LiveLinkCsv.Parse(csv);
                frames = new BoneFrames(avatar);
                bones = new Bones(avatar.Skeleton.Names.Length);
                joint = avatar.Skeleton.Names[100];
                packet = packets.Skip(4).Take(BitConverter.ToInt32(packets, 0)).ToArray();
                Level level = avatar.Program.Levels[0];
                lists = new[] { avatar.Program.Mesh, level.Deform, level.View }
                    .Select(passes => PassList.Of(avatar.Program, passes, avatar.Groups.Length)).ToArray();
            }

            public void Play(int i)
            {
                recording.Sample(i / 60.0, driving);
                Assert.IsTrue(LiveLinkPacket.Read(packet, packet.Length, driving));
                driver.Pose(driving, instance.Pose);
                clip.Sample(i / 300.0, instance.Pose);
                instance.Pose.SetJoint(joint, 0.01 * i, 0, 0);
                instance.Pose.SetExpression("jawOpen", 0.01 * i);
                frames.ToBones(instance.Pose, bones);
                frames.FromBones(bones, instance.Pose);
                frames.ToRoot(instance.Pose, translation, rotation);
                frames.FromRoot(translation, rotation, instance.Pose);
                camera.SetFrom(view, projection, 640, 480);
                camera.Orbit(target, 2, 0.01 * i, 0, 0.5, 640, 480);
                instance.Update(camera);
                for (int list = 0; list < lists.Length; list++)
                {
                    lists[list].Set(instance.Values);
                    lists[list].KeepLasting();
                }
            }

            public void Keep()
            {
                kept = new byte[1000];
                Assert.IsNotNull(kept);
            }
        }
    }
}
