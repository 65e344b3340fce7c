// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.
namespace AvatarExport.Core {
    /// <summary>Numbers of the shaders.</summary>
    public static class Constants {
        /// <summary>Version of the kernels. A pack that needs a newer one is refused.</summary>
        public const int Shaders = 1;

        /// <summary>Pixels squared added to both variances of the projected covariance, so that no splat is thinner than about a pixel.</summary>
        public const double LowPass = 0.3;

        /// <summary>Floor of mid^2 - det under the square root of the larger eigenvalue; a round splat gets sqrt(0.1) more than its variance.</summary>
        public const double EigenvalueFloor = 0.1;

        /// <summary>The trainer touches the tiles of this many standard deviations; it culls tiles, never pixels.</summary>
        public const double RadiusSigmas = 3.0;

        /// <summary>View z at or below this (in training units) is not drawn.</summary>
        public const double Near = 0.2;

        /// <summary>x/z and y/z are clamped to this times tan(fov/2) in the Jacobian, not in the centre.</summary>
        public const double FrustumClamp = 1.3;

        /// <summary>Added to clip w before its reciprocal.</summary>
        public const double HomogeneousEpsilon = 1e-07;

        /// <summary>Alpha of one splat at one pixel never exceeds this.</summary>
        public const double AlphaMax = 0.99;

        /// <summary>Alpha below 1 / this is skipped (the division is done in float32).</summary>
        public const double AlphaMinDenominator = 255.0;

        /// <summary>The splat that would bring the transmittance below this is not added and ends the pixel (trainer profile).</summary>
        public const double TransmittanceMin = 0.0001;

        /// <summary>Pixels along the side of a tile.</summary>
        public const int Tile = 16;

        /// <summary>Newton steps R &lt;- (R + R^-T) / 2 of the polar factor; 1e-14 away at 30 degrees, 1e-9 at 60.</summary>
        public const int PolarSteps = 3;

        /// <summary>Real spherical harmonics, band 0.</summary>
        public static readonly double[] ShC0 = { 0.28209479177387814 };

        /// <summary>Band 1 with its signs, factors of y, z, x.</summary>
        public static readonly double[] ShC1 = { -0.4886025119029199, 0.4886025119029199, -0.4886025119029199 };

        /// <summary>Band 2, factors of xy, yz, 2zz-xx-yy, xz, xx-yy.</summary>
        public static readonly double[] ShC2 = { 1.0925484305920792, -1.0925484305920792, 0.31539156525252005, -1.0925484305920792, 0.5462742152960396 };

        /// <summary>Band 3, factors of y(3xx-yy), xyz, y(4zz-xx-yy), z(2zz-3xx-3yy), x(4zz-xx-yy), z(xx-yy), x(xx-3yy).</summary>
        public static readonly double[] ShC3 = { -0.5900435899266435, 2.890611442640554, -0.4570457994644658, 0.3731763325901154, -0.4570457994644658, 1.445305721320277, -0.5900435899266435 };

        /// <summary>Least length, an area in training units squared, by which a summed vertex normal is divided.</summary>
        public const double NormalFloor = 1e-06;

        /// <summary>Least length, an area in training units squared, by which a summed vertex quaternion is divided.</summary>
        public const double QuaternionFloor = 1e-06;

        /// <summary>Training units squared, added to both areas of the ratio that scales a Gaussian; it dominates on meshes in metres.</summary>
        public const double AreaDamping = 0.0001;

        /// <summary>The light of the capture is taken to be at least this, so that what was dark in it does not turn to noise.</summary>
        public const double LightFloor = 0.05;

        /// <summary>Bundle units; a point light is taken to be at least this far away.</summary>
        public const double LightNearest = 0.01;

        /// <summary>Texels along an edge of a shadow map.</summary>
        public const int ShadowSize = 256;

        /// <summary>a Gaussian casts a shadow where its alpha, seen from the light, is at least this.</summary>
        public const double ShadowAlpha = 0.3;

        /// <summary>Texels squared, added to both variances of a Gaussian in a shadow map, so that none is thinner than a texel.</summary>
        public const double ShadowLowPass = 0.25;

        /// <summary>Threads of a group.</summary>
        public const int Threads = 64;

        /// <summary>Values of a digit.</summary>
        public const int SortDigits = 16;

        /// <summary>Pairs of a thread.</summary>
        public const int SortItems = 16;

        /// <summary>Pairs of a block, which a group sorts.</summary>
        public const int SortBlock = Threads * SortItems;

        /// <summary>Threads of the one group of sort_scan.</summary>
        public const int SortScanThreads = 128;

        /// <summary>Splats an instance of raster_vertex_batch.</summary>
        public const int QuadBatch = 128;

        /// <summary>Splats a row of the texture that raster_vertex_batch reads: three texels each.</summary>
        public const int QuadRow = 512;
    }
}
