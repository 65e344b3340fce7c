using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>The numbers that stages shadow and light take of a light, in the order of the values of a frame.</summary>
    public sealed class LightRows {
        /// <summary>Numbers in all.</summary>
        public const int Count = 100;

        /// <summary>[25, 4] ambient 9, places 4, colours 4, turn 3, shadow rows 4, shadow offset.</summary>
        public readonly float[] Floats = new float[Count];

        /// <summary>Parts of a reference, with their numbers, in the order of Floats.</summary>
        internal static readonly KeyValuePair<string, int>[] Parts = {
            new KeyValuePair<string, int>("light_ambient", 36), new KeyValuePair<string, int>("light_place", 16),
            new KeyValuePair<string, int>("light_colour", 16), new KeyValuePair<string, int>("light_turn", 12),
            new KeyValuePair<string, int>("shadow_row", 16), new KeyValuePair<string, int>("shadow_offset", 4),
        };

        private const int Place = 36, Colour = 52, Turn = 68, Shadow = 80, Offset = 96; // first floats
        private const double LargestColour = 1e4; // brighter than any light of a scene
        private const double LargestNumber = 1e9; // further away than any
        private const double NearestRadii = 1.05; // a point light that is nearer casts no shadow

        // How far a Gaussian is moved along its normal, and along the light, before it is asked whether it lies in shadow:
        // trained Gaussians lie in layers about the skin (bundle units), and a map has an edge of texels.
        private static readonly double[] Layers = { 0.006, 0.004 }, Texels = { 1.5, 1.0 };

        private readonly double[] linear = new double[12]; // the inverse of the place's 3x3 part
        private readonly double[] turn = new double[12]; // the place's own turn, or mirror
        private readonly double[] inverse = new double[12];
        private readonly double[] at = new double[3], first = new double[3], centre = new double[3];
        private readonly double[] axis = new double[3], across = new double[3], down = new double[3], up = new double[3];
        private readonly double[] shadow = new double[16];
        private readonly AmbientForm form = new AmbientForm();

        /// <summary>Whether there is a shadow map.</summary>
        public bool CastsShadow => Floats[Offset + 2] > 0;

        /// <summary>
        /// Takes a light of the scene, seen from the pack's own space: "placed" [4, 4] places the pack in the scene, and the
        /// avatar stands at "posed" [4, 4] in the pack's space. A place that scales evenly or mirrors is exact; one without
        /// an inverse has no light. The skin matrix of the joint of `relight` is at "skin" of "floats"; below 0: there is
        /// none. Returns what is wrong with the light, or null. Allocates nothing.
        /// </summary>
        public string Write(SceneLight light, Relight relight, double[] placed, double[] posed, float[] floats, int skin) {
            string wrong = WrongWith(light);
            if (wrong != null) return wrong;
            Array.Clear(Floats, 0, Count);
            double scale = Invert(placed);
            if (!AllFinite(linear) || !AllFinite(turn)) return null;
            for (int channel = 0; channel < 3; channel++) form.Write(light.Ambient, channel, turn, Floats);
            WriteTurn(relight, posed, floats, skin);
            for (int i = 0; i < light.Count; i++) WriteLight(i, light.Lights[i], placed, scale);
            if (light.Shadow && light.Count > 0) WriteShadow(light.Lights[0].IsPoint, relight, posed);
            return AllFinite(Floats) ? null : "is beyond the numbers of float32 where the avatar stands";
        }

        private static string WrongWith(SceneLight light) {
            if (light.Count < 0 || light.Count > SceneLight.Most) return "has more than 4 lights";
            if (!Within(light.Ambient, -LargestNumber, LargestNumber)) return "a number of ambient is not finite, or beyond 1e9";
            for (int i = 0; i < light.Count; i++) {
                DirectLight one = light.Lights[i];
                if (!Within(one.Place, -LargestNumber, LargestNumber)) return "the place of a light is not finite, or beyond 1e9";
                if (!Within(one.Colour, 0, LargestColour)) return "the colour of a light is not within 0 and 10000";
                if (!one.IsPoint && !(Dot(one.Place, 0, one.Place) > 0)) return "the direction of a light has no length";
            }
            return null;
        }

        private static bool Within(double[] numbers, double low, double high) {
            bool isSound = true;
            for (int i = 0; i < numbers.Length; i++) isSound &= numbers[i] >= low && numbers[i] <= high;
            return isSound;
        }

        private static bool AllFinite(double[] numbers) => Within(numbers, -float.MaxValue, float.MaxValue);

        private static bool AllFinite(float[] numbers) {
            bool isFinite = true;
            for (int i = 0; i < numbers.Length; i++) isFinite &= Math.Abs(numbers[i]) <= float.MaxValue;
            return isFinite;
        }

        /// <summary>The way from the scene to the pack; returns lengths in the scene by those in the pack.</summary>
        private double Invert(double[] placed) {
            Affine.InvertLinear(linear, 0, placed, 0);
            double scale = Math.Pow(Math.Abs(Affine.Determinant(placed, 0)), 1.0 / 3);
            for (int i = 0; i < 12; i++) turn[i] = i % 4 == 3 ? 0 : placed[i] / scale;
            Affine.Polar(turn, 0, Constants.PolarSteps, inverse);
            return scale;
        }

        /// <summary>The inverse of how the light of the capture has turned with the avatar and its head.</summary>
        private void WriteTurn(Relight relight, double[] posed, float[] floats, int skin) {
            Affine.SetIdentity(turn, 0, 3);
            for (int i = 0; i < 12 && skin >= 0; i++) turn[i] = floats[skin + i];
            if (relight.Follows) Affine.MultiplyLinear(turn, 0, posed, 0, turn, 0);
            for (int row = 0; row < 3; row++) {
                for (int k = 0; k < 3; k++) Floats[Turn + 4 * row + k] = (float)turn[4 * k + row];
            }
        }

        private void WriteLight(int index, DirectLight one, double[] placed, double scale) {
            for (int i = 0; i < 3; i++) centre[i] = one.Place[i] - (one.IsPoint ? placed[4 * i + 3] : 0);
            for (int row = 0; row < 3; row++) at[row] = Dot(linear, 4 * row, centre);
            if (!one.IsPoint) MakeUnit(at);
            double fall = one.IsPoint ? scale * scale : 1; // distances are shorter by the scale here
            for (int i = 0; i < 3; i++) {
                Floats[Place + 4 * index + i] = (float)at[i];
                Floats[Colour + 4 * index + i] = (float)(one.Colour[i] / fall);
            }
            Floats[Place + 4 * index + 3] = one.IsPoint ? 1 : 0;
            if (index == 0) Array.Copy(at, first, 3);
        }

        /// <summary>
        /// Column, row, distance and w of a shadow map that holds the sphere of `relight`; none if a point light is within
        /// what it lights.
        /// </summary>
        private void WriteShadow(bool isPoint, Relight relight, double[] posed) {
            for (int i = 0; i < 3; i++) centre[i] = Dot(posed, 4 * i, relight.Centre) + posed[4 * i + 3];
            for (int i = 0; i < 3; i++) axis[i] = first[i] - (isPoint ? centre[i] : 0);
            double radius = relight.Radius, distance = MakeUnit(axis);
            if (isPoint && !(distance > NearestRadii * radius)) return;
            bool isUpright = Math.Abs(axis[1]) < 0.9;
            up[0] = isUpright ? 0 : 1;
            up[1] = isUpright ? 1 : 0;
            Cross(across, up, axis);
            MakeUnit(across);
            Cross(down, across, axis);
            double half = Constants.ShadowSize / 2.0, middle = half - 0.5;
            double[] eye = isPoint ? first : centre;
            double scale = isPoint ? half * Math.Sqrt(distance * distance - radius * radius) / radius : half / radius;
            for (int k = 0; k < 3; k++) {
                shadow[12 + k] = isPoint ? -axis[k] : 0;
                shadow[8 + k] = -axis[k];
            }
            shadow[15] = isPoint ? Dot(axis, 0, eye) : 1;
            shadow[11] = Dot(axis, 0, eye) + (isPoint ? 0 : radius);
            SetSide(0, across, eye, scale, middle);
            SetSide(4, down, eye, scale, middle);
            for (int i = 0; i < 16; i++) Floats[Shadow + i] = (float)shadow[i];
            double texel = 2 * radius / Constants.ShadowSize;
            for (int i = 0; i < 2; i++) Floats[Offset + i] = (float)(Layers[i] + Texels[i] * texel);
            Floats[Offset + 2] = 1;
        }

        /// <summary>The row at `o` of the map's column or row, after its row of w.</summary>
        private void SetSide(int o, double[] along, double[] eye, double scale, double middle) {
            for (int k = 0; k < 3; k++) shadow[o + k] = scale * along[k] + middle * shadow[12 + k];
            shadow[o + 3] = middle * shadow[15] - scale * Dot(along, 0, eye);
        }

        private static double Dot(double[] a, int i, double[] b) => a[i] * b[0] + a[i + 1] * b[1] + a[i + 2] * b[2];

        private static void Cross(double[] result, double[] a, double[] b) {
            result[0] = a[1] * b[2] - a[2] * b[1];
            result[1] = a[2] * b[0] - a[0] * b[2];
            result[2] = a[0] * b[1] - a[1] * b[0];
        }

        /// <summary>Scales v to length 1; returns the length that it had.</summary>
        private static double MakeUnit(double[] v) {
            double length = Math.Sqrt(Dot(v, 0, v));
            for (int i = 0; i < 3; i++) v[i] /= length;
            return length;
        }
    }
}
