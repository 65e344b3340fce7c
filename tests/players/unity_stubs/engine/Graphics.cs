// Stands in for Unity in tests: what runs on a GPU is recorded. Signatures are Unity's; bodies are ours.
using System;
using System.Collections.Generic;
using UnityEngine.Rendering;

namespace UnityEngine {
    public enum RenderTextureFormat { ARGBHalf = 2, ARGBFloat = 11 }
    public enum RenderTextureReadWrite { Default = 0, Linear = 1 }
    public enum TextureFormat { RGBA32 = 4, RGBAFloat = 20 }
    public enum FilterMode { Point = 0 }
    public enum MeshTopology { Triangles = 0 }
    public enum CubemapFace { Unknown = -1 }
    public enum ColorSpace { Gamma = 0, Linear = 1 }

    public static partial class SystemInfo {
        internal static int vertexBuffers = 8;
        internal static bool compute = true, reversed = true, top = true, multiview;
        internal static long most = 1L << 31;
        public static GraphicsDeviceType graphicsDeviceType => GraphicsDeviceType.Vulkan;
        public static bool supportsComputeShaders => compute;
        public static int maxComputeBufferInputsVertex => vertexBuffers;
        public static int maxComputeBufferInputsCompute => 8;
        public static int maxComputeWorkGroupSizeX => 1024;
        public static long maxGraphicsBufferSize => most;
        public static bool usesReversedZBuffer => reversed;
        public static bool graphicsUVStartsAtTop => top;
        public static bool supportsMultiview => multiview;
        public static bool SupportsBlendingOnRenderTextureFormat(RenderTextureFormat format) => true;
        public static bool SupportsRandomWriteOnRenderTextureFormat(RenderTextureFormat format) => true;
    }

    public static class QualitySettings {
        public static ColorSpace activeColorSpace => ColorSpace.Linear;
    }

    public static partial class Screen { public static int height => 1080; }

    public static class ScalableBufferManager {
        public static float widthScaleFactor => 1;
        public static float heightScaleFactor => 1;
    }

    public class Texture : Object {
        public virtual int width { get; set; }
        public virtual int height { get; set; }
        public FilterMode filterMode { get; set; }
    }

    public class RenderTexture : Texture {
        public RenderTexture(int width, int height, int depth, RenderTextureFormat format, RenderTextureReadWrite readWrite) {
            this.width = width;
            this.height = height;
        }
        public bool enableRandomWrite { get; set; }
        public int volumeDepth { get; set; }
        public static RenderTexture active { get; set; }
        public bool Create() => true;
    }

    public sealed partial class Texture2D : Texture {
        public Texture2D(int width, int height, TextureFormat textureFormat, bool mipChain, bool linear) { this.width = width; this.height = height; }
        public void ReadPixels(Rect source, int destX, int destY, bool recalculateMipMaps) { }
        public Color[] GetPixels() => new Color[width * height];
    }

    public struct RenderTextureDescriptor {
        public int width { get; set; }
        public int height { get; set; }
        public int volumeDepth { get; set; }
        public TextureDimension dimension { get; set; }
        public bool useDynamicScale { get; set; }
    }

    public sealed class Shader : Object {
        internal static readonly List<string> names = new List<string>();
        internal static int lookups;
        internal static bool found = true;
        public static Shader Find(string name) { return found ? new Shader { name = name } : null; }
        public static int PropertyToID(string name) {
            lookups++;
            if (!names.Contains(name)) names.Add(name);
            return names.IndexOf(name);
        }
    }

    public sealed class ComputeShader : Object {
        internal static bool runs = true;
        public bool HasKernel(string name) => runs && name == this.name;
        public bool IsSupported(int kernelIndex) => runs;
        public int FindKernel(string name) { if (name != this.name) throw new ArgumentException(name); return 0; }
    }

    public class Material : Object {
        internal readonly List<string> keywords = new List<string>();
        public Material(Shader shader) { name = shader.name; }
        public void EnableKeyword(string keyword) { keywords.Add(keyword); }
    }

    public sealed class MaterialPropertyBlock {
        internal readonly Dictionary<int, object> values = new Dictionary<int, object>();
        internal readonly Dictionary<int, Vector4> vectors = new Dictionary<int, Vector4>();
        public void SetInteger(int nameID, int value) { vectors[nameID] = new Vector4(value, 0, 0, 0); }
        public void SetFloat(int nameID, float value) { vectors[nameID] = new Vector4(value, 0, 0, 0); }
        public void SetVector(int nameID, Vector4 value) { vectors[nameID] = value; }
        public void SetBuffer(int nameID, GraphicsBuffer value) { values[nameID] = value; }
        public void SetTexture(int nameID, Texture value) { values[nameID] = value; }
    }

    public sealed class GraphicsBuffer : IDisposable {
        [Flags]
        public enum Target { Index = 2, Structured = 16 }

        internal static readonly List<GraphicsBuffer> Live = new List<GraphicsBuffer>();
        internal static long uploads;
        internal readonly byte[] bytes;
        public GraphicsBuffer(Target target, int count, int stride) {
            if (count < 1 || stride < 1) throw new ArgumentException("an empty buffer");
            this.count = count;
            this.stride = stride;
            bytes = new byte[(long)count * stride];
            Live.Add(this);
        }
        public int count { get; private set; }
        public int stride { get; private set; }
        public void SetData(Array data) { Fill(data); }
        public void GetData(Array data) { System.Buffer.BlockCopy(bytes, 0, data, 0, System.Buffer.ByteLength(data)); }
        public void Dispose() { if (!Live.Remove(this)) throw new ObjectDisposedException("GraphicsBuffer"); }
        internal void Fill(Array data) {
            int length = System.Buffer.ByteLength(data);
            if (length > bytes.Length) throw new ArgumentException(length + " bytes into " + bytes.Length);
            System.Buffer.BlockCopy(data, 0, bytes, 0, length);
            uploads += length;
        }
    }

    public static class Graphics {
        internal static CommandBuffer executed;
        public static void ExecuteCommandBuffer(CommandBuffer buffer) { executed = buffer; }
    }

    namespace Rendering {
        public enum GraphicsDeviceType { Direct3D11 = 2, Null = 4, OpenGLES3 = 11, Metal = 16, OpenGLCore = 17, Direct3D12 = 18, Vulkan = 21 }
        public enum IndexFormat { UInt16 = 0, UInt32 = 1 }
        public enum ShadowCastingMode { Off = 0, On = 1, ShadowsOnly = 3 }
        public enum TextureDimension { Tex2D = 2, Tex2DArray = 5 }
        public enum CameraEvent { AfterForwardAlpha = 17 }
        public enum BuiltinRenderTextureType { CameraTarget = 2 }

        public struct RenderTargetIdentifier {
            internal string text;
            public RenderTargetIdentifier(BuiltinRenderTextureType type) { text = type.ToString(); }
            public RenderTargetIdentifier(int nameID) { text = Shader.names[nameID]; }
            public static implicit operator RenderTargetIdentifier(Texture tex) { return new RenderTargetIdentifier { text = "texture" }; }
        }

        public struct ScriptableRenderContext { public void ExecuteCommandBuffer(CommandBuffer commandBuffer) { } }
        public class RenderPipelineAsset : ScriptableObject { public virtual Material defaultMaterial => null; }
        public static class GraphicsSettings { public static RenderPipelineAsset currentRenderPipeline => null; }

        public static class RenderPipelineManager {
            public static event Action<ScriptableRenderContext, Camera> beginCameraRendering;
            internal static void Begin(Camera camera) { beginCameraRendering(new ScriptableRenderContext(), camera); }
        }
    }
}
