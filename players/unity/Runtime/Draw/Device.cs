using UnityEngine;

namespace AvatarExport {
    /// <summary>What this device lacks to compute splats.</summary>
    internal static class Device {
        private const int KernelBuffers = 4; // storage buffers that a kernel binds at most
        private const int KernelThreads = 128; // of a group

        /// <summary>What is missing, as the end of a sentence; or null.</summary>
        public static string Lack() {
            string api = SystemInfo.graphicsDeviceType.ToString();
            if (!SystemInfo.supportsComputeShaders) return api + " has no compute shaders here";
            if (SystemInfo.maxComputeBufferInputsCompute < KernelBuffers) {
                int binds = SystemInfo.maxComputeBufferInputsCompute;
                return $"{api} binds {binds} buffers to a compute shader, and {KernelBuffers} are needed";
            }
            if (SystemInfo.maxComputeWorkGroupSizeX < KernelThreads) {
                int threads = SystemInfo.maxComputeWorkGroupSizeX;
                return $"{api} has {threads} threads in a group, and {KernelThreads} are needed";
            }
            bool texture = SystemInfo.SupportsRandomWriteOnRenderTextureFormat(RenderTextureFormat.ARGBFloat);
            if (SystemInfo.maxComputeBufferInputsVertex < 1 && !texture) {
                return api + " has neither storage buffers in vertex shaders nor float textures that shaders write";
            }
            return null;
        }
    }
}
