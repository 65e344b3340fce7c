using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>Where an array of a stage lies in the planes of a buffer: four floats a row and plane.</summary>
    internal struct Place {
        public int Plane;
        public int First; // of the four floats
        public int Components;
        public bool ByComponent; // component k lies in Plane + k, at First
    }

    /// <summary>Arrays of the stages to and from the planes of Splats, Sh and Projected.</summary>
    internal static class Planes {
        public const int Splats = 5; // planes
        public const int Projected = 3;
        public const string ShRotation = "sh_rotation"; // [N, 3, 3] in the first three floats of planes 2 to 4

        public static readonly Dictionary<string, Place> SplatPlaces = new Dictionary<string, Place> {
            { "mean", new Place { Plane = 0, First = 0, Components = 3 } },
            { "opacity_logit", new Place { Plane = 0, First = 3, Components = 1 } },
            { "opacity", new Place { Plane = 0, First = 3, Components = 1 } },
            { "quat_wxyz", new Place { Plane = 1, First = 0, Components = 4 } },
            { "log_scale", new Place { Plane = 2, First = 3, Components = 3, ByComponent = true } },
            { "scale", new Place { Plane = 2, First = 3, Components = 3, ByComponent = true } },
        };

        public static readonly Dictionary<string, Place> ProjectedPlaces = new Dictionary<string, Place> {
            { "centre", new Place { Plane = 0, First = 0, Components = 2 } },
            { "depth", new Place { Plane = 0, First = 2, Components = 1 } },
            { "opacity", new Place { Plane = 0, First = 3, Components = 1 } },
            { "conic", new Place { Plane = 1, First = 0, Components = 3 } },
            { "radius", new Place { Plane = 1, First = 3, Components = 1 } },
            { "rgb", new Place { Plane = 2, First = 0, Components = 3 } },
        };

        /// <summary>Components of a row of an array.</summary>
        public static int Components(Dictionary<string, Place> places, string name) {
            return name == ShRotation ? 9 : places[name].Components;
        }

        /// <summary>Writes the rows of a chunk of an array into planes.</summary>
        public static void Put(float[] planes, Dictionary<string, Place> places, string name, double[] values, Run chunk) {
            int width = Components(places, name);
            for (int row = 0; row < chunk.Count; row++) {
                for (int k = 0; k < width; k++) {
                    planes[Index(places, name, row, k, chunk.Count)] = (float)values[(chunk.First + row) * width + k];
                }
            }
        }

        /// <summary>Reads an array of planes into the rows of a chunk.</summary>
        public static void Take(float[] planes, Dictionary<string, Place> places, string name, double[] into, Run chunk) {
            int width = Components(places, name);
            for (int row = 0; row < chunk.Count; row++) {
                for (int k = 0; k < width; k++) {
                    into[(chunk.First + row) * width + k] = planes[Index(places, name, row, k, chunk.Count)];
                }
            }
        }

        private static int Index(Dictionary<string, Place> places, string name, int row, int k, int count) {
            if (name == ShRotation) return 4 * ((2 + k / 3) * count + row) + k % 3;
            Place place = places[name];
            int plane = place.ByComponent ? place.Plane + k : place.Plane;
            return 4 * (plane * count + row) + place.First + (place.ByComponent ? 0 : k);
        }
    }
}
