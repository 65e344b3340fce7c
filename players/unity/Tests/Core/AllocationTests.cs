using System;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>A frame allocates nothing: 51 expressions that move joints, 262 joints, anchors.</summary>
    public sealed class AllocationTests {
        internal static object Kept; // so that nothing leaves it out

        [Test]
        public void AFrameAllocatesNothing() {
            LoadedAvatar avatar = Cases.Loaded("wide");
            Assert.AreEqual(new[] { 51, 262 }, new[] { avatar.Expressions.Length, avatar.Skeleton.Names.Length });
            AllocatesNothing(Frame(avatar));
        }

        [Test]
        public void ALitFrameAllocatesNothing() {
            LoadedAvatar avatar = LoadedAvatar.Load(Cases.Bytes("light_left.avatar"));
            var light = new SceneLight { Count = 2, Shadow = true };
            var instance = new Instance(avatar, 0) { Light = light };
            var camera = new AvatarCamera();
            PassList[] lists = new[] { instance.Program.Shadow, instance.Program.Light }
                .Select(passes => PassList.Of(avatar.Program, passes, avatar.Groups.Length)).ToArray();
            light.Lights[1].IsPoint = true;
            AllocatesNothing(i => {
                light.Lights[0].Place[0] = i + 1;
                instance.Update(camera);
                Assert.IsTrue(instance.CastsShadow);
                for (int list = 0; list < lists.Length; list++) lists[list].Set(instance.Values);
            });
        }

        private static void AllocatesNothing(Action<int> play) {
            for (int i = 0; i < 3; i++) play(i); // until everything is compiled
            // Bytes that this thread has allocated. Not every runtime that Unity has tells them.
            System.Reflection.MethodInfo told = typeof(GC).GetMethod("GetAllocatedBytesForCurrentThread");
            if (told == null) Assert.Ignore("this runtime does not tell what was allocated");
            var allocated = (Func<long>)Delegate.CreateDelegate(typeof(Func<long>), told);
            long before = allocated();
            for (int i = 0; i < 50; i++) play(i);
            long grown = allocated() - before;
            Assert.AreEqual(0, grown, "bytes of 50 frames");
            Kept = new byte[1000]; // the counter counts
            Assert.Greater(allocated() - before, 999);
        }

        /// <summary>Everything that a frame may do.</summary>
        private static Action<int> Frame(LoadedAvatar avatar) {
            var instance = new Instance(avatar, 0);
            var driver = new Driver(avatar, true);
            Recording recording = LiveLinkCsv.Parse(Cases.Text("recording.csv"));
            var frames = new BoneFrames(avatar);
            var bones = new Bones(avatar.Skeleton.Names.Length);
            string joint = avatar.Skeleton.Names[100];
            byte[] packets = Cases.Bytes("packets.bin"), packet = packets.Skip(4).Take(BitConverter.ToInt32(packets, 0)).ToArray();
            Level level = avatar.Program.Levels[0];
            PassList[] lists = new[] { avatar.Program.Mesh, level.Deform, level.View }
                .Select(passes => PassList.Of(avatar.Program, passes, avatar.Groups.Length)).ToArray();
            var driving = new DrivingFrame();
            var camera = new AvatarCamera();
            double[] target = new double[3], translation = new double[3], rotation = new double[4];
            double[] view = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1, 0, 0, 0, 1 };
            double[] projection = { 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, -1, -0.1, 0, 0, -1, 0 };
            return i => {
                recording.Sample(i / 60.0, driving);
                Assert.IsTrue(LiveLinkPacket.Read(packet, packet.Length, driving));
                driver.Pose(driving, instance.Pose);
                Idle.Write(i / 60.0, 3, driving);
                avatar.Clips[0].Pose(i / 300.0, instance.Pose);
                instance.Pose.SetJoint(joint, 0.01 * i, 0, 0);
                instance.Pose.SetExpression("jawOpen", 0.01 * i);
                frames.ToBones(instance.Pose, bones);
                frames.FromBones(bones, instance.Pose);
                frames.ToRoot(instance.Pose, translation, rotation);
                frames.FromRoot(translation, rotation, instance.Pose);
                camera.FromOpengl(view, projection, 640, 480);
                camera.Orbit(target, 2, 0.01 * i, 0, 0.5, 640, 480);
                instance.Update(camera);
                for (int list = 0; list < lists.Length; list++) {
                    lists[list].Set(instance.Values);
                    lists[list].KeepLasting();
                }
            };
        }
    }
}
