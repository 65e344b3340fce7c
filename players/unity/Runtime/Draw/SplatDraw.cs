using System;
using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport {
    /// <summary>
    /// Draws quads into an image of floats of its own, and that image onto a camera's target once. It binds no depth
    /// buffer: fragments compare with the camera's depth texture, so that the samples, the size and the slices of
    /// targets do not matter.
    /// </summary>
    internal sealed class SplatDraw : IDisposable {
        private const int Batch = 128; // splats an instance: AVATAR_QUAD_BATCH
        private const int Row = 512; // splats a row of the texture: AVATAR_QUAD_ROW
        private const int Corners = 6; // indices a splat
        private const int SplatPass = 0, CompositePass = 1;

        private static readonly int AccumulatedId = Shader.PropertyToID("Accumulated");
        private static readonly int QuadsId = Shader.PropertyToID("Quads");
        private static readonly int QuadTexelsId = Shader.PropertyToID("QuadTexels");
        private static readonly int QuadCountId = Shader.PropertyToID("quad_count");
        private static readonly int ImageSizeId = Shader.PropertyToID("image_size");
        private static readonly int FlipYId = Shader.PropertyToID("flip_y");
        private static readonly int DepthSignId = Shader.PropertyToID("depth_sign");
        private static readonly int DepthSliceId = Shader.PropertyToID("depth_slice");
        private static readonly int BackgroundId = Shader.PropertyToID("background");
        private static readonly int LinearTargetId = Shader.PropertyToID("linear_target");
        private static readonly int FlipRowsId = Shader.PropertyToID("flip_rows");
        private static readonly int TargetFirstId = Shader.PropertyToID("target_first");
        private static readonly int TargetRowsId = Shader.PropertyToID("target_rows");
        private static readonly int TopRowFirstId = Shader.PropertyToID("top_row_first");

        private readonly Material material; // reads a depth texture
        private readonly Material arrayMaterial; // reads a slice of one
        private readonly MaterialPropertyBlock properties = new MaterialPropertyBlock();
        private readonly GraphicsBuffer indices;
        private readonly RenderTextureFormat format;
        private readonly RenderTargetIdentifier accumulated = new RenderTargetIdentifier(AccumulatedId);
        private readonly AvatarView alone = new AvatarView { Eyes = 1 };
        private readonly bool throughTexture; // the vertex stage has no storage buffers
        private RenderTexture texels;
        private readonly Kernel copy; // of quads into texels

        /// <summary>Throws AvatarError where the package's files are not whole, or a shader does not run.</summary>
        public SplatDraw() {
            Shader shader = Kernels.Splat();
            throughTexture = SystemInfo.maxComputeBufferInputsVertex < 1;
            if (throughTexture) copy = Kernels.Of("quad_texels");
            material = Make(shader, false);
            arrayMaterial = Make(shader, true);
            // 32 bits round to what the splats were trained with; 16 bits, where a GPU cannot blend them, round at
            // every splat.
            bool exact = SystemInfo.SupportsBlendingOnRenderTextureFormat(RenderTextureFormat.ARGBFloat);
            format = exact ? RenderTextureFormat.ARGBFloat : RenderTextureFormat.ARGBHalf;
            indices = new GraphicsBuffer(GraphicsBuffer.Target.Index, Corners * Batch, sizeof(ushort));
            indices.SetData(BatchIndices());
        }

        /// <summary>Records the picture of one eye.</summary>
        public void Record(CommandBuffer commands, AvatarView view, int eye, GraphicsBuffer quads, int count) {
            Material drawn = view.IsArray ? arrayMaterial : material;
            commands.GetTemporaryRT(AccumulatedId, view.Width, view.Height, 0, FilterMode.Point, format);
            SetProperties(view, eye);
            RecordSplats(commands, accumulated, drawn, quads, count);
            if (view.IsArray) commands.SetRenderTarget(view.Target, 0, CubemapFace.Unknown, eye);
            else commands.SetRenderTarget(view.Target);
            commands.SetViewport(view.Viewport);
            commands.DrawProcedural(Matrix4x4.identity, drawn, CompositePass, MeshTopology.Triangles, 3, 1, properties);
            commands.ReleaseTemporaryRT(AccumulatedId);
        }

        /// <summary>
        /// Records the quads alone, over nothing, into a float image of that size: its bottom row comes first.
        /// </summary>
        public void RecordImage(CommandBuffer commands, RenderTexture image, GraphicsBuffer quads, int count) {
            alone.Fill(image, image.width, image.height);
            SetProperties(alone, 0);
            RecordSplats(commands, alone.Target, material, quads, count);
        }

        /// <inheritdoc/>
        public void Dispose() {
            indices.Dispose();
            Objects.Destroy(material);
            Objects.Destroy(arrayMaterial);
            Objects.Destroy(texels);
        }

        private Material Make(Shader shader, bool depthIsArray) {
            var made = new Material(shader) { hideFlags = HideFlags.HideAndDontSave };
            if (throughTexture) made.EnableKeyword("AVATAR_QUAD_TEXTURE");
            if (depthIsArray) made.EnableKeyword("AVATAR_DEPTH_ARRAY");
            return made;
        }

        private void RecordSplats(CommandBuffer commands, RenderTargetIdentifier image, Material drawn,
            GraphicsBuffer quads, int count) {
            if (throughTexture) {
                RecordCopy(commands, quads, count);
                properties.SetTexture(QuadTexelsId, texels);
            } else {
                properties.SetBuffer(QuadsId, quads);
            }
            properties.SetInteger(QuadCountId, count);
            commands.SetRenderTarget(image);
            commands.ClearRenderTarget(false, true, Color.clear);
            int batches = (count + Batch - 1) / Batch;
            commands.DrawProcedural(
                indices, Matrix4x4.identity, drawn, SplatPass, MeshTopology.Triangles, Corners * Batch, batches,
                    properties);
        }

        private void SetProperties(AvatarView view, int eye) {
            properties.SetVector(ImageSizeId, new Vector4(view.Width, view.Height, 0, 0));
            properties.SetFloat(FlipYId, SystemInfo.graphicsUVStartsAtTop ? -1 : 1);
            properties.SetFloat(DepthSignId, view.HasDepth ? (SystemInfo.usesReversedZBuffer ? -1 : 1) : 0);
            properties.SetInteger(DepthSliceId, eye);
            properties.SetVector(BackgroundId, Vector4.zero);
            properties.SetFloat(LinearTargetId, QualitySettings.activeColorSpace == ColorSpace.Linear ? 1 : 0);
            properties.SetFloat(FlipRowsId, 0);
            properties.SetVector(TargetFirstId, new Vector4(view.Viewport.x, view.Viewport.y, 0, 0));
            properties.SetFloat(TargetRowsId, view.TargetRows);
            properties.SetFloat(TopRowFirstId, SystemInfo.graphicsUVStartsAtTop ? view.TopRowFirst : 0);
        }

        private void RecordCopy(CommandBuffer commands, GraphicsBuffer quads, int count) {
            int rows = (count + Row - 1) / Row;
            if (texels == null || texels.height < rows) {
                Objects.Destroy(texels);
                texels = new RenderTexture(3 * Row, Math.Max(rows, 1), 0, RenderTextureFormat.ARGBFloat,
                    RenderTextureReadWrite.Linear) {
                    enableRandomWrite = true, filterMode = FilterMode.Point, hideFlags = HideFlags.HideAndDontSave,
                };
                texels.Create();
            }
            commands.SetComputeBufferParam(copy.Shader, copy.Index, QuadsId, quads);
            commands.SetComputeTextureParam(copy.Shader, copy.Index, QuadTexelsId, texels);
            commands.SetComputeIntParam(copy.Shader, QuadCountId, count);
            commands.DispatchCompute(copy.Shader, copy.Index, (3 * count + 63) / 64, 1, 1);
        }

        /// <summary>Two triangles a splat: vertex 4 k + c is corner c of splat k.</summary>
        private static ushort[] BatchIndices() {
            int[] corners = { 0, 1, 2, 2, 1, 3 };
            var made = new ushort[Corners * Batch];
            for (int i = 0; i < made.Length; i++) made[i] = (ushort)(4 * (i / Corners) + corners[i % Corners]);
            return made;
        }
    }
}
