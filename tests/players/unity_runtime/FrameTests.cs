using System;
using System.Collections.Generic;
using NUnit.Framework;
using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport.Tests
{
    /// <summary>What a frame records is the core's lists of passes, in order, and then two draws.</summary>
    public sealed class FrameTests
    {
        private Stage stage;

        [SetUp]
        public void Begin()
        {
            stage = new Stage();
        }

        [TestCase(Packs.Joints)]
        [TestCase(Packs.Surface)]
        [TestCase(Packs.WithoutRig)]
        public void DispatchesAreThoseOfTheCore(string pack)
        {
            GaussianAvatar avatar = stage.Add(pack);
            CommandBuffer commands = stage.Frame();
            Core.Instance wanted = Wanted(pack);
            Core.SceneSort sort = Core.SceneSort.Of(Chunks(wanted));
            var lists = new List<Core.PassList>();
            Core.Program program = avatar.Avatar.Program;
            int groups = avatar.Avatar.Groups.Length;
            if (program.ReadsMesh) lists.Add(Core.PassList.Of(program, program.Mesh, groups));
            lists.Add(Core.PassList.Of(program, wanted.Program.Deform, groups));
            lists.Add(Core.PassList.Of(program, wanted.Program.View, groups));
            foreach (Core.PassList one in lists) one.Set(wanted.Values);
            lists.Add(sort.Passes);
            var bound = new Dictionary<string, GraphicsBuffer>();
            int at = 0;
            foreach (Core.PassList list in lists)
            {
                foreach (Core.Dispatch one in list.Dispatches) at = AssertDispatch(commands, at, list, one, bound);
            }
            Assert.AreEqual(-1, Next(commands, at, "DispatchCompute"), "more dispatches than the core has");
            AssertBuffers(avatar.Avatar, sort, bound, wanted);
            stage.End();
        }

        [TestCase(0, 0, 100f)] // straight onto the screen
        [TestCase(200, Stage.Height, 0f)] // into an image of its own, of that size
        [TestCase(320, Stage.Height, 100f)] // the window of the Editor
        public void ACameraOfAPartOfTheScreenDrawsWhereItsPictureIs(int width, int height, float left)
        {
            stage.Add(Packs.Joints);
            stage.Camera.pixelRect = new Rect(100, 0, 200, Stage.Height);
            var format = RenderTextureFormat.ARGBHalf;
            stage.Camera.activeTexture =
                width == 0 ? null : new RenderTexture(width, height, 0, format, RenderTextureReadWrite.Linear);
            CommandBuffer commands = stage.Frame();
            Command set = Stage.All(commands, "SetViewport")[0];
            Assert.AreEqual(left, set.Value.x);
            Assert.AreEqual(200f, set.Value.z);
            stage.End();
        }

        [Test]
        public void SplatsAreDrawnIntoAnImageThatIsPutOntoTheCameraOnce()
        {
            stage.Add(Packs.Joints);
            CommandBuffer commands = stage.Frame();
            string[] order =
                { "GetTemporaryRT", "SetRenderTarget", "ClearRenderTarget", "DrawProcedural", "SetRenderTarget",
                "SetViewport", "DrawProcedural", "ReleaseTemporaryRT" };
            int at = Next(commands, 0, order[0]);
            for (int i = 0; i < order.Length; i++) Assert.AreEqual(order[i], commands.pool[at + i].What);
            Assert.AreEqual((float)Stage.Width, commands.pool[at].Value.x);
            Assert.AreEqual((float)Stage.Height, commands.pool[at].Value.y);
            Assert.AreEqual("Accumulated", commands.pool[at + 1].Target);
            Command splats = commands.pool[at + 3], composite = commands.pool[at + 6];
            int count = stage.Avatars[0].Avatar.Levels[0].Count;
            Assert.AreEqual(0, splats.Id);
            Assert.AreEqual(6 * 128, splats.Count);
            Assert.AreEqual((count + 127) / 128, splats.Instances);
            Assert.AreEqual("CameraTarget", commands.pool[at + 4].Target);
            Assert.AreEqual(1, composite.Id);
            Assert.AreEqual(3, composite.Count);
            Assert.AreEqual((float)count, Value(splats, "quad_count").x);
            Assert.AreEqual(-1f, Value(splats, "flip_y").x);
            Assert.AreEqual(-1f, Value(splats, "depth_sign").x);
            Assert.AreEqual(1f, Value(composite, "linear_target").x);
            Assert.IsTrue((stage.Camera.depthTextureMode & DepthTextureMode.Depth) != 0);
            stage.End();
        }

        [Test]
        public void BothEyesShareOneDeformation()
        {
            stage.Add(Packs.Joints);
            stage.Camera.stereoEnabled = true;
            for (int eye = 0; eye < 2; eye++)
            {
                Matrix4x4 view = stage.Camera.worldToCameraMatrix;
                view.m03 = eye == 0 ? 0.03f : -0.03f;
                stage.Camera.stereoViews[eye] = view;
            }
            CommandBuffer commands = stage.Frame();
            List<string> entries = Stage.Entries(commands);
            Assert.AreEqual(1, entries.FindAll(one => one == "activate").Count);
            Assert.AreEqual(2, entries.FindAll(one => one == "project").Count);
            Assert.AreEqual(16, entries.FindAll(one => one == "sort_scan").Count);
            List<Command> targets = Stage.All(commands, "SetRenderTarget").FindAll(one => one.Target == "CameraTarget");
            Assert.AreEqual(2, targets.Count);
            Assert.AreEqual(0, targets[0].Count);
            Assert.AreEqual(1, targets[1].Count);
            List<Command> rows =
                Stage.All(commands, "SetComputeVectorParam").FindAll(one => Shader.names[one.Id] == "camera_row0");
            Assert.AreEqual(0.03f, rows[0].Value.w);
            Assert.AreEqual(-0.03f, rows[1].Value.w);
            List<Command> times = Stage.All(commands, "SetInstanceMultiplier");
            Assert.AreEqual(1, times[0].Count);
            Assert.AreEqual(2, times[1].Count);
            stage.End();
        }

        [Test]
        public void ASecondCameraUsesTheSameDeformation()
        {
            stage.Add(Packs.Joints);
            stage.Frame();
            List<string> entries = Stage.Entries(Stage.Render(Stage.NewCamera()));
            Assert.AreEqual("project", entries[0]);
            stage.End();
        }

        [Test]
        public void TwoAvatarsAreSortedTogether()
        {
            stage.Add(Packs.Joints);
            stage.Add(Packs.WithoutRig);
            CommandBuffer commands = stage.Frame();
            Assert.AreEqual(1, Stage.All(commands, "GetTemporaryRT").Count);
            int first = stage.Avatars[0].Avatar.Levels[0].Count;
            List<Command> firsts = Stage.All(commands, "SetComputeIntParam").FindAll(
                one => one.Shader.name == "sort_keys" && Shader.names[one.Id] == "first");
            Assert.AreEqual(0, firsts[0].Count);
            Assert.AreEqual(first, firsts[firsts.Count - 1].Count);
            stage.End();
        }

        [Test]
        public void VertexShadersWithoutBuffersReadATexture()
        {
            SystemInfo.vertexBuffers = 0;
            stage.Add(Packs.Joints);
            CommandBuffer commands = stage.Frame();
            List<string> entries = Stage.Entries(commands);
            Assert.AreEqual("quad_texels", entries[entries.Count - 1]);
            Command splats = Stage.All(commands, "DrawProcedural")[0];
            Assert.IsTrue(((Material)splats.Shader).keywords.Contains("AVATAR_QUAD_TEXTURE"));
            Assert.IsTrue(((MaterialPropertyBlock)splats.Given).values.ContainsKey(Shader.PropertyToID("QuadTexels")));
            stage.End();
        }

        private static Core.Instance Wanted(string pack)
        {
            // Read again, so that nothing is shared with what is judged.
            var instance = new Core.Instance(Packs.Read(pack), 0);
            var camera = new Core.Camera();
            Camera unity = Stage.NewCamera();
            new CameraMatrices().Write(unity.worldToCameraMatrix, unity.projectionMatrix, true, Stage.Width,
                Stage.Height, camera);
            CameraMatrices.WriteWorld(Matrix4x4.identity, instance.World);
            instance.Update(camera);
            return instance;
        }

        private static List<Core.ProjectedChunk> Chunks(Core.Instance instance)
        {
            var chunks = new List<Core.ProjectedChunk>();
            for (int i = 0; i < instance.Program.Chunks.Length; i++)
            {
                string buffer = "0/" + instance.Program.Prefix + "Projected." + i;
                chunks.Add(new Core.ProjectedChunk { Buffer = buffer, Count = instance.Program.Chunks[i].Count });
            }
            return chunks;
        }

        private static int AssertDispatch(
            CommandBuffer commands, int at, Core.PassList list, Core.Dispatch one,
            Dictionary<string, GraphicsBuffer> bound)
        {
            int end = Next(commands, at, "DispatchCompute");
            Assert.IsTrue(end >= 0, "no dispatch of " + one.Entry);
            Assert.AreEqual(one.Entry, commands.pool[end].Shader.name);
            Assert.AreEqual(one.Groups, commands.pool[end].Count, one.Entry);
            var given = new Dictionary<string, Command>();
            for (int i = at; i < end; i++)
            {
                if (commands.pool[i].What.StartsWith("SetCompute"))
                {
                    given.Add(Shader.names[commands.pool[i].Id], commands.pool[i]);
                }
            }
            Assert.AreEqual(one.Buffers.Length + one.Constants.Length, given.Count, one.Entry);
            foreach (Core.BufferBinding binding in one.Buffers)
            {
                Bind(bound, binding.Buffer.Substring(binding.Buffer.IndexOf('/') + 1),
                    (GraphicsBuffer)given[binding.Name].Given);
            }
            foreach (Core.ConstantSlot slot in one.Constants) AssertConstant(list, slot, given[slot.Name], one.Entry);
            return end + 1;
        }

        /// <summary>One buffer has one name, in all dispatches.</summary>
        private static void Bind(Dictionary<string, GraphicsBuffer> bound, string name, GraphicsBuffer buffer)
        {
            GraphicsBuffer known;
            if (bound.TryGetValue(name, out known)) Assert.AreSame(known, buffer, name);
            else Assert.IsFalse(bound.ContainsValue(buffer), name + " is another buffer, too");
            bound[name] = buffer;
        }

        private static void AssertConstant(Core.PassList list, Core.ConstantSlot slot, Command given, string entry)
        {
            string where = entry + " " + slot.Name;
            if (slot.Type == Core.ConstantType.UInt)
            {
                Assert.AreEqual("SetComputeIntParam", given.What, where);
                Assert.AreEqual(list.UInts[slot.First], (uint)given.Count, where);
                return;
            }
            Assert.AreEqual(slot.Type == Core.ConstantType.Float ? "SetComputeFloatParam" : "SetComputeVectorParam",
                given.What, where);
            float[] values = { given.Value.x, given.Value.y, given.Value.z, given.Value.w };
            for (int k = 0; k < (int)slot.Type; k++) Assert.AreEqual(list.Floats[slot.First + k], values[k], where);
        }

        private static void AssertBuffers(Core.Avatar avatar, Core.SceneSort sort,
            Dictionary<string, GraphicsBuffer> bound, Core.Instance wanted)
        {
            foreach (Core.SceneBuffer one in sort.Buffers)
            {
                Assert.IsTrue(bound[one.Name].count >= one.Count, one.Name);
                Assert.AreEqual(one.Stride, bound[one.Name].stride, one.Name);
            }
            foreach (KeyValuePair<string, GraphicsBuffer> one in bound)
            {
                Core.Buffer described;
                if (!avatar.Program.Buffers.TryGetValue(one.Key, out described)) continue;
                Assert.IsTrue(one.Value.bytes.Length >= described.Bytes, one.Key);
                if (described.Sections.Length > 0) AssertWords(described.Content(), one.Value.bytes, one.Key);
            }
            GraphicsBuffer pose;
            if (!bound.TryGetValue("Pose", out pose)) return;
            var words = new uint[wanted.PoseFloats.Length];
            Buffer.BlockCopy(wanted.PoseFloats, 0, words, 0, 4 * words.Length);
            AssertWords(words, pose.bytes, "Pose");
        }

        private static void AssertWords(uint[] wanted, byte[] bytes, string name)
        {
            for (int i = 0; i < wanted.Length; i++)
            {
                Assert.AreEqual(wanted[i], BitConverter.ToUInt32(bytes, 4 * i), name + " word " + i);
            }
        }

        private static Vector4 Value(Command draw, string name)
        {
            return ((MaterialPropertyBlock)draw.Given).vectors[Shader.PropertyToID(name)];
        }

        private static int Next(CommandBuffer commands, int at, string what)
        {
            for (int i = at; i < commands.used; i++)
            {
                if (commands.pool[i].What == what) return i;
            }
            return -1;
        }
    }
}
