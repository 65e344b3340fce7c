// Stands in for the Core render pipeline library in tests. Signatures are Unity's; bodies are ours.
using System;
using System.Runtime.CompilerServices;

namespace UnityEngine.Rendering {
    public class RTHandle {
        public RenderTexture rt => null;
        public RenderTargetIdentifier nameID => new RenderTargetIdentifier();
    }

    public static class TextureXR { public static bool useTexArray => true; }

    public static class CommandBufferPool {
        public static CommandBuffer Get(string name) => new CommandBuffer();
        public static void Release(CommandBuffer buffer) { }
    }

#if UNITY_6000_0_OR_NEWER
    public class ContextContainer { public T Get<T>() where T : class => null; }
    public class UnsafeCommandBuffer { }

    public struct CommandBufferHelpers {
        public static CommandBuffer GetNativeCommandBuffer(UnsafeCommandBuffer baseBuffer) => null;
    }
#endif
}

#if UNITY_6000_0_OR_NEWER
namespace UnityEngine.Rendering.RenderGraphModule {
    [Flags]
    public enum AccessFlags { None = 0, Read = 1, Write = 2, ReadWrite = 3 }
    public delegate void BaseRenderFunc<PassData, ContextType>(PassData data, ContextType renderGraphContext) where PassData : class, new();

    public struct TextureHandle {
        public bool IsValid() => false;
        public static implicit operator RTHandle(TextureHandle texture) => null;
    }

    public class UnsafeGraphContext { public UnsafeCommandBuffer cmd; }

    public interface IBaseRenderGraphBuilder : IDisposable {
        void UseTexture(in TextureHandle input, AccessFlags flags = AccessFlags.Read);
        void AllowPassCulling(bool value);
        void AllowGlobalStateModification(bool value);
    }

    public interface IUnsafeRenderGraphBuilder : IBaseRenderGraphBuilder {
        void SetRenderFunc<PassData>(BaseRenderFunc<PassData, UnsafeGraphContext> renderFunc) where PassData : class, new();
    }

    public class RenderGraph {
        public IUnsafeRenderGraphBuilder AddUnsafePass<PassData>(
            string passName, out PassData passData, [CallerFilePath] string file = "", [CallerLineNumber] int line = 0) where PassData : class, new() {
            passData = new PassData();
            return null;
        }
    }
}
#endif
