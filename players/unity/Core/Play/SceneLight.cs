namespace AvatarExport.Core {
    /// <summary>A light from one direction, or from one point, in the scene's space.</summary>
    public sealed class DirectLight {
        /// <summary>[3] towards the light, of any length; of a point light where it is, metres.</summary>
        public readonly double[] Place = new double[3];

        /// <summary>
        /// [3] linear, 0 to 10000: what a white matt surface reflects that faces it; of a point light from 1 m.
        /// </summary>
        public readonly double[] Colour = new double[3];

        /// <summary>Whether it is a point light.</summary>
        public bool IsPoint;
    }

    /// <summary>The light of a scene, in the scene's space and in linear colours. It may be changed between updates.</summary>
    public sealed class SceneLight {
        /// <summary>Lights that are taken.</summary>
        public const int Most = 4;

        /// <summary>
        /// [9, 3] what a white matt surface reflects, as SH of its normal; bases and signs are those of the Gaussians'
        /// colours. One colour from all sides: it is the first row times Constants.ShC0[0], the other rows are 0.
        /// </summary>
        public readonly double[] Ambient = new double[27];

        /// <summary>The first Count are used.</summary>
        public readonly DirectLight[] Lights = { new DirectLight(), new DirectLight(), new DirectLight(), new DirectLight() };

        /// <summary>How many lights there are.</summary>
        public int Count;

        /// <summary>Whether the first light casts a shadow.</summary>
        public bool Shadow;
    }
}
