using System;
using System.Collections.Generic;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;
using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport.Tests {
    /// <summary>What a frame records is the core's lists of passes, in order, and then two draws.</summary>
    public sealed class FrameTests : Stage {
        [TestCase(Packs.Joints)]
        [TestCase(Packs.Surface)]
        [TestCase(Packs.WithoutRig)]
        public void DispatchesAreThoseOfTheCore(string pack) {
            LoadedAvatar avatar = Add(pack).Avatar;
            CommandBuffer commands = Frame();
            Instance wanted = Wanted(pack);
            SceneSort sort = SceneSort.Of(ProjectedChunk.Of(wanted.Program, "0/").ToArray());
            Program program = avatar.Program;
            var passes = new List<Pass[]> { wanted.Program.Deform, wanted.Program.View };
            if (program.ReadsMesh) passes.Insert(0, program.Mesh);
            List<PassList> lists = passes.ConvertAll(one => PassList.Of(program, one, avatar.Groups.Length));
            foreach (PassList one in lists) one.Set(wanted.Values);
            lists.Add(sort.Passes);
            var bound = new Dictionary<string, GraphicsBuffer>();
            int at = 0;
            foreach (PassList list in lists) {
                foreach (Dispatch one in list.Dispatches) at = AssertDispatch(commands, at, list, one, bound);
            }
            Assert.AreEqual(-1, Next(commands, at, "DispatchCompute"), "more dispatches than the core has");
            AssertBuffers(avatar, sort, bound, wanted);
        }

        [TestCase(0, 0, 100f)] // straight onto the screen
        [TestCase(200, Height, 0f)] // into an image of its own, of that size
        [TestCase(320, Height, 100f)] // the window of the Editor
        public void ACameraOfAPartOfTheScreenDrawsWhereItsPictureIs(int width, int height, float left) {
            Add(Packs.Joints);
            Seen.pixelRect = new Rect(100, 0, 200, Height);
            Seen.activeTexture = width == 0
                ? null : new RenderTexture(width, height, 0, RenderTextureFormat.ARGBHalf, RenderTextureReadWrite.Linear);
            Vector4 set = All(Frame(), "SetViewport")[0].Value;
            Assert.AreEqual(new[] { left, 200f }, new[] { set.x, set.z });
        }

        [Test]
        public void SplatsAreDrawnIntoAnImageThatIsPutOntoTheCameraOnce() {
            GaussianAvatar avatar = Add(Packs.Joints);
            CommandBuffer commands = Frame();
            string[] order = {
                "GetTemporaryRT", "SetRenderTarget", "ClearRenderTarget", "DrawProcedural", "SetRenderTarget", "SetViewport",
                "DrawProcedural", "ReleaseTemporaryRT",
            };
            List<Command> drawn = commands.pool.GetRange(Next(commands, 0, order[0]), order.Length);
            Assert.AreEqual(order, drawn.Select(one => one.What));
            Assert.AreEqual(new float[] { Width, Height }, new[] { drawn[0].Value.x, drawn[0].Value.y });
            Assert.AreEqual(new[] { "Accumulated", "CameraTarget" }, new[] { drawn[1].Target, drawn[4].Target });
            Command splats = drawn[3], composite = drawn[6];
            int count = avatar.Avatar.Levels[0].Count;
            Assert.AreEqual(new[] { 0, 6 * 128, (count + 127) / 128 }, new[] { splats.Id, splats.Count, splats.Instances });
            Assert.AreEqual(new[] { 1, 3 }, new[] { composite.Id, composite.Count });
            Assert.AreEqual((float)count, Value(splats, "quad_count").x);
            Assert.AreEqual(-1f, Value(splats, "flip_y").x);
            Assert.AreEqual(-1f, Value(splats, "depth_sign").x);
            Assert.AreEqual(1f, Value(composite, "linear_target").x);
            Assert.IsTrue((Seen.depthTextureMode & DepthTextureMode.Depth) != 0);
        }

        [Test]
        public void BothEyesShareOneDeformation() {
            Add(Packs.Joints);
            Seen.stereoEnabled = true;
            for (int eye = 0; eye < 2; eye++) {
                Matrix4x4 view = Seen.worldToCameraMatrix;
                view.m03 = eye == 0 ? 0.03f : -0.03f;
                Seen.stereoViews[eye] = view;
            }
            CommandBuffer commands = Frame();
            ILookup<string, string> entries = Entries(commands).ToLookup(one => one);
            Assert.AreEqual(new[] { 1, 2, 16 }, new[] { "activate", "project", "sort_scan" }.Select(one => entries[one].Count()));
            var targets = All(commands, "SetRenderTarget").Where(one => one.Target == "CameraTarget");
            Assert.AreEqual(new[] { 0, 1 }, targets.Select(one => one.Count));
            var rows = All(commands, "SetComputeVectorParam").Where(one => Shader.names[one.Id] == "camera_row0");
            Assert.AreEqual(new[] { 0.03f, -0.03f }, rows.Select(one => one.Value.w));
            Assert.AreEqual(new[] { 1, 2 }, All(commands, "SetInstanceMultiplier").Select(one => one.Count));
        }

        [Test]
        public void TwoAvatarsAreSortedTogether() {
            int first = Add(Packs.Joints).Avatar.Levels[0].Count;
            Add(Packs.WithoutRig);
            CommandBuffer commands = Frame();
            Assert.AreEqual(1, All(commands, "GetTemporaryRT").Count);
            List<Command> firsts = All(commands, "SetComputeIntParam").FindAll(
                one => one.Shader.name == "sort_keys" && Shader.names[one.Id] == "first");
            Assert.AreEqual(new[] { 0, first }, new[] { firsts[0].Count, firsts[firsts.Count - 1].Count });
        }

        [Test]
        public void VertexShadersWithoutBuffersReadATexture() {
            SystemInfo.vertexBuffers = 0;
            Add(Packs.Joints);
            CommandBuffer commands = Frame();
            Assert.AreEqual("quad_texels", Entries(commands).Last());
            Command splats = All(commands, "DrawProcedural")[0];
            Assert.IsTrue(((Material)splats.Shader).keywords.Contains("AVATAR_QUAD_TEXTURE"));
            Assert.IsTrue(((MaterialPropertyBlock)splats.Given).values.ContainsKey(Shader.PropertyToID("QuadTexels")));
        }

        [Test]
        public void AStageReadsAndWritesTheBuffersOfItsNames() {
            int before = GraphicsBuffer.Live.Count;
            LoadedAvatar avatar = Packs.Read(Packs.Surface);
            Level level = avatar.Program.Levels[0];
            SceneSort sort = SceneSort.Of(ProjectedChunk.Of(level, "0/").ToArray());
            using (var runner = new GpuStageRunner()) {
                runner.Load(avatar.Program, sort.Buffers);
                runner.Write("Pairs", new uint[] { 7, 8, 9 });
                var words = new uint[3];
                runner.Read("Pairs", words);
                Assert.AreEqual(9u, words[2]);
                foreach (PassList list in new[] { PassList.Of(avatar.Program, level.Deform, avatar.Groups.Length), sort.Passes }) {
                    for (int i = 0; i < list.Dispatches.Length; i++) {
                        runner.Run(list, i);
                        Assert.AreEqual(new[] { list.Dispatches[i].Entry }, Entries(Graphics.executed));
                    }
                }
                Assert.AreEqual(4 * 6 * 5, runner.Draw(sort.Count, 6, 5).Length);
            }
            Assert.AreEqual(before, GraphicsBuffer.Live.Count);
        }

        /// <summary>Read again, so that nothing is shared with what is judged.</summary>
        private static Instance Wanted(string pack) {
            var instance = new Instance(Packs.Read(pack), 0);
            var camera = new AvatarCamera();
            Camera unity = NewCamera();
            new CameraMatrices().Write(unity.worldToCameraMatrix, unity.projectionMatrix, true, Width, Height, camera);
            CameraMatrices.WritePlace(Matrix4x4.identity, instance.Place);
            instance.Update(camera);
            return instance;
        }

        private static int AssertDispatch(
            CommandBuffer commands, int at, PassList list, Dispatch one, Dictionary<string, GraphicsBuffer> bound) {
            int end = Next(commands, at, "DispatchCompute");
            Assert.IsTrue(end >= 0, "no dispatch of " + one.Entry);
            Assert.AreEqual(one.Entry, commands.pool[end].Shader.name);
            Assert.AreEqual(one.Groups, commands.pool[end].Count, one.Entry);
            var given = new Dictionary<string, Command>();
            foreach (Command set in commands.pool.Skip(at).Take(end - at).Where(set => set.What.StartsWith("SetCompute"))) {
                given.Add(Shader.names[set.Id], set);
            }
            Assert.AreEqual(one.Buffers.Length + one.Constants.Length, given.Count, one.Entry);
            foreach (BufferBinding binding in one.Buffers) {
                string name = binding.Buffer.Substring(binding.Buffer.IndexOf('/') + 1);
                Bind(bound, name, (GraphicsBuffer)given[binding.Name].Given);
            }
            foreach (ConstantSlot slot in one.Constants) AssertConstant(list, slot, given[slot.Name], one.Entry);
            return end + 1;
        }

        /// <summary>One buffer has one name, in all dispatches.</summary>
        private static void Bind(Dictionary<string, GraphicsBuffer> bound, string name, GraphicsBuffer buffer) {
            GraphicsBuffer known;
            if (bound.TryGetValue(name, out known)) Assert.AreSame(known, buffer, name);
            else Assert.IsFalse(bound.ContainsValue(buffer), name + " is another buffer, too");
            bound[name] = buffer;
        }

        private static void AssertConstant(PassList list, ConstantSlot slot, Command given, string entry) {
            string where = entry + " " + slot.Name;
            if (slot.Type == ConstantType.UInt) {
                Assert.AreEqual("SetComputeIntParam", given.What, where);
                Assert.AreEqual(list.UInts[slot.First], (uint)given.Count, where);
                return;
            }
            Assert.AreEqual(slot.Type == ConstantType.Float ? "SetComputeFloatParam" : "SetComputeVectorParam",
                given.What, where);
            float[] values = { given.Value.x, given.Value.y, given.Value.z, given.Value.w };
            for (int k = 0; k < (int)slot.Type; k++) Assert.AreEqual(list.Floats[slot.First + k], values[k], where);
        }

        private static void AssertBuffers(LoadedAvatar avatar, SceneSort sort,
            Dictionary<string, GraphicsBuffer> bound, Instance wanted) {
            foreach (SceneBuffer one in sort.Buffers) {
                Assert.IsTrue(bound[one.Name].count >= one.Count, one.Name);
                Assert.AreEqual(one.Stride, bound[one.Name].stride, one.Name);
            }
            foreach (KeyValuePair<string, GraphicsBuffer> one in bound) {
                ProgramBuffer described;
                if (!avatar.Program.Buffers.TryGetValue(one.Key, out described)) continue;
                Assert.IsTrue(one.Value.bytes.Length >= described.Bytes, one.Key);
                if (described.Sections.Length > 0) AssertBytes(described.Content(), one.Value.bytes, one.Key);
            }
            GraphicsBuffer pose;
            if (!bound.TryGetValue("Pose", out pose)) return;
            AssertBytes(wanted.PoseFloats, pose.bytes, "Pose");
        }

        private static void AssertBytes(Array wanted, byte[] bytes, string name) {
            var want = new byte[Buffer.ByteLength(wanted)];
            Buffer.BlockCopy(wanted, 0, want, 0, want.Length);
            Assert.AreEqual(want, bytes.Take(want.Length), name);
        }

        private static Vector4 Value(Command draw, string name) {
            return ((MaterialPropertyBlock)draw.Given).vectors[Shader.PropertyToID(name)];
        }

        private static int Next(CommandBuffer commands, int at, string what) {
            return commands.pool.FindIndex(at, commands.used - at, one => one.What == what);
        }
    }
}
