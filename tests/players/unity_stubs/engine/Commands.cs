// Stands in for Unity in tests: a command buffer that keeps what was recorded. Signatures are Unity's; bodies are ours.
using System;
using System.Collections.Generic;

namespace UnityEngine.Rendering {
    /// <summary>A recorded command. The pool of commands is kept, so that recording allocates nothing here either.</summary>
    internal sealed class Command {
        public string What; // of the method
        public Object Shader; // or material
        public int Id; // of a name; or an integer
        public object Given; // a buffer, a texture, an array, a property block
        public string Target;
        public Vector4 Value;
        public int Count; // groups, indices, vertices
        public int Instances;
    }

    public class CommandBuffer : IDisposable {
        internal readonly List<Command> pool = new List<Command>();
        internal int used;
        public string name { get; set; }
        public void Clear() { used = 0; }
        public void Release() { }
        public void Dispose() { }
        public void BeginSample(string name) { Next("BeginSample"); }
        public void EndSample(string name) { Next("EndSample"); }
        public void SetInstanceMultiplier(uint multiplier) { Next("SetInstanceMultiplier").Count = (int)multiplier; }
        public void SetBufferData(GraphicsBuffer buffer, Array data) { buffer.Fill(data); Next("SetBufferData").Given = buffer; }
        public void SetComputeBufferParam(ComputeShader computeShader, int kernelIndex, int nameID, GraphicsBuffer buffer) {
            Named("SetComputeBufferParam", computeShader, nameID).Given = buffer;
        }
        public void SetComputeTextureParam(ComputeShader computeShader, int kernelIndex, int nameID, RenderTargetIdentifier rt) {
            Named("SetComputeTextureParam", computeShader, nameID);
        }
        public void SetComputeIntParam(ComputeShader computeShader, int nameID, int val) { Named("SetComputeIntParam", computeShader, nameID).Count = val; }
        public void SetComputeFloatParam(ComputeShader computeShader, int nameID, float val) {
            Named("SetComputeFloatParam", computeShader, nameID).Value = new Vector4(val, 0, 0, 0);
        }
        public void SetComputeVectorParam(ComputeShader computeShader, int nameID, Vector4 val) {
            Named("SetComputeVectorParam", computeShader, nameID).Value = val;
        }
        public void DispatchCompute(ComputeShader computeShader, int kernelIndex, int threadGroupsX, int threadGroupsY, int threadGroupsZ) {
            if (threadGroupsX < 1 || threadGroupsX > 65535) throw new ArgumentException(threadGroupsX + " groups");
            Named("DispatchCompute", computeShader, 0).Count = threadGroupsX;
        }
        public void GetTemporaryRT(int nameID, int width, int height, int depthBuffer, FilterMode filter, RenderTextureFormat format) {
            Named("GetTemporaryRT", null, nameID).Value = new Vector4(width, height, depthBuffer, (int)format);
        }
        public void ReleaseTemporaryRT(int nameID) { Named("ReleaseTemporaryRT", null, nameID); }
        public void SetRenderTarget(RenderTargetIdentifier rt) { Next("SetRenderTarget").Target = rt.text; }
        public void SetRenderTarget(RenderTargetIdentifier rt, int mipLevel, CubemapFace cubemapFace, int depthSlice) {
            Command made = Next("SetRenderTarget");
            made.Target = rt.text;
            made.Count = depthSlice;
        }
        public void SetRenderTarget(RenderTargetIdentifier color, RenderTargetIdentifier depth, int mipLevel, CubemapFace cubemapFace, int depthSlice) {
            SetRenderTarget(color, mipLevel, cubemapFace, depthSlice);
        }
        public void SetViewport(Rect pixelRect) { Next("SetViewport").Value = new Vector4(pixelRect.x, pixelRect.y, pixelRect.width, pixelRect.height); }
        public void ClearRenderTarget(bool clearDepth, bool clearColor, Color backgroundColor) { Next("ClearRenderTarget"); }
        public void DrawProcedural(
            Matrix4x4 matrix, Material material, int shaderPass, MeshTopology topology, int vertexCount, int instanceCount,
            MaterialPropertyBlock properties) {
            Draw(material, shaderPass, vertexCount, instanceCount, properties);
        }
        public void DrawProcedural(
            GraphicsBuffer indexBuffer, Matrix4x4 matrix, Material material, int shaderPass, MeshTopology topology, int indexCount,
            int instanceCount, MaterialPropertyBlock properties) {
            Draw(material, shaderPass, indexCount, instanceCount, properties);
        }

        private void Draw(Material material, int pass, int count, int instances, MaterialPropertyBlock properties) {
            Command made = Next("DrawProcedural");
            made.Shader = material;
            made.Id = pass;
            made.Count = count;
            made.Instances = instances;
            made.Given = properties;
        }

        private Command Named(string what, Object shader, int id) {
            Command made = Next(what);
            made.Shader = shader;
            made.Id = id;
            return made;
        }

        private Command Next(string what) {
            if (used == pool.Count) pool.Add(new Command());
            Command made = pool[used++];
            made.What = what;
            made.Shader = null;
            made.Given = null;
            made.Target = null;
            made.Id = made.Count = made.Instances = 0;
            made.Value = Vector4.zero;
            return made;
        }
    }
}
