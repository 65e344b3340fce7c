using System;
using AvatarExport.Core;
using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport {
    /// <summary>
    /// A list of dispatches with their GPU buffers: recorded again each frame, made once. Names are ids already, so
    /// recording allocates nothing.
    /// </summary>
    internal sealed class RecordedPasses {
        private readonly PassList list;
        private readonly Recorded[] recorded;

        /// <summary>"buffer" gives the GPU buffer of a name of the program or of the scene.</summary>
        public RecordedPasses(PassList list, Func<string, GraphicsBuffer> buffer) {
            this.list = list;
            recorded = new Recorded[list.Dispatches.Length];
            for (int i = 0; i < recorded.Length; i++) recorded[i] = new Recorded(list.Dispatches[i], buffer);
        }

        /// <summary>Takes values of the frame. Returns whether one has changed.</summary>
        public bool Set(FrameValues values) => list.Set(values);

        /// <summary>PassList.KeepLasting: call it when what was recorded has run once.</summary>
        public void KeepLasting() => list.KeepLasting();

        public void Record(CommandBuffer commands) {
            for (int i = 0; i < recorded.Length; i++) Record(commands, recorded[i]);
        }

        public void Record(CommandBuffer commands, int dispatch) => Record(commands, recorded[dispatch]);

        private void Record(CommandBuffer commands, Recorded one) {
            ComputeShader shader = one.Kernel.Shader;
            for (int i = 0; i < one.Buffers.Length; i++) {
                commands.SetComputeBufferParam(shader, one.Kernel.Index, one.BufferIds[i], one.Buffers[i]);
            }
            for (int i = 0; i < one.Constants.Length; i++) {
                SetConstant(commands, shader, one.ConstantIds[i], one.Constants[i]);
            }
            commands.DispatchCompute(shader, one.Kernel.Index, one.Groups, 1, 1);
        }

        private void SetConstant(CommandBuffer commands, ComputeShader shader, int id, ConstantSlot slot) {
            int at = slot.First;
            float[] floats = list.Floats;
            switch (slot.Type) {
                case ConstantType.UInt:
                    commands.SetComputeIntParam(shader, id, unchecked((int)list.UInts[at]));
                    break;
                case ConstantType.Float:
                    commands.SetComputeFloatParam(shader, id, floats[at]);
                    break;
                case ConstantType.Float2:
                    commands.SetComputeVectorParam(shader, id, new Vector4(floats[at], floats[at + 1], 0, 0));
                    break;
                case ConstantType.Float3:
                    commands.SetComputeVectorParam(shader, id,
                        new Vector4(floats[at], floats[at + 1], floats[at + 2], 0));
                    break;
                default:
                    commands.SetComputeVectorParam(shader, id,
                        new Vector4(floats[at], floats[at + 1], floats[at + 2], floats[at + 3]));
                    break;
            }
        }

        private sealed class Recorded {
            public readonly Kernel Kernel;
            public readonly int Groups;
            public readonly int[] BufferIds;
            public readonly GraphicsBuffer[] Buffers;
            public readonly int[] ConstantIds;
            public readonly ConstantSlot[] Constants;

            public Recorded(Dispatch dispatch, Func<string, GraphicsBuffer> buffer) {
                Kernel = Kernels.Of(dispatch.Entry);
                Groups = dispatch.Groups;
                Buffers = Array.ConvertAll(dispatch.Buffers, one => buffer(one.Buffer));
                BufferIds = Array.ConvertAll(dispatch.Buffers, one => Shader.PropertyToID(one.Name));
                Constants = dispatch.Constants;
                ConstantIds = Array.ConvertAll(dispatch.Constants, one => Shader.PropertyToID(one.Name));
            }
        }
    }
}
