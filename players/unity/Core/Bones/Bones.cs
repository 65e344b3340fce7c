namespace AvatarExport.Core {
    /// <summary>
    /// What an engine's bones hold: local transforms, parent from bone = T R S, in the engine's left-handed frame, one
    /// bone a joint in the order of Skeleton.Names. A child inherits its parent's scale.
    /// </summary>
    public sealed class Bones {
        /// <summary>[J, 3] metres.</summary>
        public readonly double[] Translation;

        /// <summary>Unit quaternions [J, 4] as x, y, z, w.</summary>
        public readonly double[] Rotation;

        /// <summary>[J, 3].</summary>
        public readonly double[] Scale;

        /// <summary>That many bones; all is 0.</summary>
        public Bones(int joints) {
            Translation = new double[3 * joints];
            Rotation = new double[4 * joints];
            Scale = new double[3 * joints];
        }
    }
}
