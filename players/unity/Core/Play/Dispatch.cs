namespace AvatarExport.Core {
    /// <summary>The type of a constant, as HLSL has it.</summary>
    public enum ConstantType {
        /// <summary>uint, in PassList.UInts.</summary>
        UInt,

        /// <summary>float, in PassList.Floats as all that follow.</summary>
        Float,

        /// <summary>float2.</summary>
        Float2,

        /// <summary>float3.</summary>
        Float3,

        /// <summary>float4.</summary>
        Float4,
    }

    /// <summary>Where a constant of a dispatch lies.</summary>
    public struct ConstantSlot {
        /// <summary>The shader's name.</summary>
        public string Name;

        /// <summary>Its type.</summary>
        public ConstantType Type;

        /// <summary>Index into PassList.UInts (UInt) or PassList.Floats.</summary>
        public int First;
    }

    /// <summary>Which buffer a shader's name stands for.</summary>
    public struct BufferBinding {
        /// <summary>The shader's name.</summary>
        public string Name;

        /// <summary>A buffer of the program or of the scene.</summary>
        public string Buffer;
    }

    /// <summary>One dispatch of one kernel.</summary>
    public sealed class Dispatch {
        /// <summary>The kernel.</summary>
        public string Entry;

        /// <summary>The stage that it belongs to.</summary>
        public string Stage;

        /// <summary>Thread groups.</summary>
        public int Groups;

        /// <summary>All buffers of the kernel.</summary>
        public BufferBinding[] Buffers;

        /// <summary>All constants of the kernel.</summary>
        public ConstantSlot[] Constants;
    }
}
