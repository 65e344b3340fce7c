using System;
using System.Collections.Generic;
using AvatarExport.Core;
using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport {
    /// <summary>Runs single stages on this machine's GPU, for Conform. Dispose of it at the end.</summary>
    public sealed class GpuStageRunner : IStageRunner, IDisposable {
        private readonly CommandBuffer commands = new CommandBuffer { name = "Conform" };
        private readonly Dictionary<string, GraphicsBuffer> buffers = new Dictionary<string, GraphicsBuffer>();
        private readonly Dictionary<PassList, RecordedPasses> recorded
            = new Dictionary<PassList, RecordedPasses>();
        private SplatDraw draw;

        /// <summary>Throws AvatarError where this device cannot compute splats.</summary>
        public GpuStageRunner() {
            string lack = Device.Lack();
            if (lack != null) throw new AvatarError(lack, "this device");
        }

        /// <inheritdoc/>
        public void Load(Program program, SceneBuffer[] scene) {
            Free();
            Dictionary<string, int> strides = GpuBuffers.Strides(program, program.Levels[0]);
            foreach (KeyValuePair<string, int> bound in strides) {
                buffers[bound.Key] = GpuBuffers.Make("the reference", program.Buffers[bound.Key], bound.Value);
            }
            foreach (SceneBuffer one in scene) {
                buffers[one.Name] = GpuBuffers.Make("the scene", one.Name, one.Count, one.Stride);
            }
        }

        /// <inheritdoc/>
        public void Write(string buffer, uint[] words) {
            if (words.Length > 0) buffers[buffer].SetData(words);
        }

        /// <inheritdoc/>
        public void Read(string buffer, uint[] words) {
            if (words.Length > 0) buffers[buffer].GetData(words);
        }

        /// <inheritdoc/>
        public void Run(PassList passes, int dispatch) {
            RecordedPasses known;
            if (!recorded.TryGetValue(passes, out known)) recorded[passes] = known = new RecordedPasses(passes, Find);
            commands.Clear();
            known.Record(commands, dispatch);
            Graphics.ExecuteCommandBuffer(commands);
        }

        /// <inheritdoc/>
        public float[] Draw(int quads, int width, int height) {
            if (draw == null) draw = new SplatDraw();
            var image =
                new RenderTexture(width, height, 0, RenderTextureFormat.ARGBFloat, RenderTextureReadWrite.Linear);
            image.Create();
            commands.Clear();
            draw.RecordImage(commands, image, buffers["Quads"], quads);
            Graphics.ExecuteCommandBuffer(commands);
            float[] found = Pixels(image);
            Objects.Destroy(image);
            return found;
        }

        /// <inheritdoc/>
        public void Dispose() {
            Free();
            commands.Release();
            if (draw != null) draw.Dispose();
            draw = null;
        }

        /// <summary>Buffers of chunks are named "0/NAME" in a scene, and "NAME" in the program.</summary>
        private GraphicsBuffer Find(string name) => buffers[name.Substring(name.IndexOf('/') + 1)];

        private void Free() {
            foreach (GraphicsBuffer buffer in buffers.Values) buffer.Dispose();
            buffers.Clear();
            recorded.Clear();
        }

        /// <summary>
        /// [height, width, 4], top row first. The image begins with its bottom row, and so does what Unity reads.
        /// </summary>
        private static float[] Pixels(RenderTexture image) {
            int width = image.width, height = image.height;
            RenderTexture before = RenderTexture.active;
            RenderTexture.active = image;
            var copy = new Texture2D(width, height, TextureFormat.RGBAFloat, false, true);
            copy.ReadPixels(new Rect(0, 0, width, height), 0, 0, false);
            RenderTexture.active = before;
            Color[] pixels = copy.GetPixels();
            Objects.Destroy(copy);
            var found = new float[4 * width * height];
            for (int i = 0; i < pixels.Length; i++) {
                int at = 4 * ((height - 1 - i / width) * width + i % width);
                for (int c = 0; c < 4; c++) found[at + c] = pixels[i][c];
            }
            return found;
        }
    }
}
