using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>A number, a vector, or the name of a value of the frame: "world_row0", "group_matrix_row1[2]".</summary>
    public sealed class Constant {
        /// <summary>It counts if Source and Vector are null.</summary>
        public double Number;

        /// <summary>Two to four floats; or null.</summary>
        public double[] Vector;

        /// <summary>The name of a value of the frame; or null.</summary>
        public string Source;
    }

    /// <summary>One dispatch of one kernel.</summary>
    public sealed class Pass {
        /// <summary>The kernel, as Interfaces.All names it.</summary>
        public string Entry;

        /// <summary>Threads that have work; a group has 64.</summary>
        public long Rows;

        /// <summary>The shader's name of a buffer -&gt; a name of Program.Buffers.</summary>
        public Dictionary<string, string> Buffers;

        /// <summary>By the names of the kernel's uniform block.</summary>
        public Dictionary<string, Constant> Constants;
    }

    /// <summary>Rows First .. First + Count of an avatar's Gaussians.</summary>
    public struct Run {
        /// <summary>The first row.</summary>
        public int First;

        /// <summary>How many rows.</summary>
        public int Count;
    }

    /// <summary>One level of detail. Chunk i is in the buffers Prefix + "Splats." + i, Sh and Projected.</summary>
    public sealed class Level {
        /// <summary>Of the names of its buffers.</summary>
        public string Prefix;

        /// <summary>They follow each other and cover all Gaussians of the level.</summary>
        public Run[] Chunks;

        /// <summary>Run once a pose.</summary>
        public Pass[] Deform;

        /// <summary>Run once a camera.</summary>
        public Pass[] View;

        /// <summary>Run once a pose and light, where it casts shadows; none where Light has none.</summary>
        public Pass[] Shadow;

        /// <summary>Run once a camera, after View, where the scene has a light; none: colours stay as trained.</summary>
        public Pass[] Light;
    }

    /// <summary>First floats of the sections of buffer Pose.</summary>
    public struct PoseSections {
        /// <summary>[K] weights of expressions.</summary>
        public int Weights;

        /// <summary>[9 C] pose features.</summary>
        public int Features;

        /// <summary>[L] weights of late morphs.</summary>
        public int Late;

        /// <summary>[J, 3, 4] skin matrices.</summary>
        public int Joints;
    }

    /// <summary>All that a player runs up to stage project. Sorting and drawing belong to its scene.</summary>
    public sealed class Program {
        /// <summary>By name.</summary>
        public Dictionary<string, ProgramBuffer> Buffers;

        /// <summary>Stages morph and skin.</summary>
        public Pass[] Mesh;

        /// <summary>Finest first.</summary>
        public Level[] Levels;

        /// <summary>Where the sections of buffer Pose begin.</summary>
        public PoseSections Pose;

        /// <summary>Floats of buffer Pose.</summary>
        public int PoseFloats;

        /// <summary>Whether Deform reads buffer Mesh: then the passes of Mesh run before it.</summary>
        public bool ReadsMesh;
    }

    /// <summary>What a pass may ask of a frame. Names that begin with "group_" have a row a group.</summary>
    internal static class FrameSources {
        /// <summary>Name -> floats.</summary>
        public static readonly Dictionary<string, int> Floats = new Dictionary<string, int> {
            ["world_row0"] = 4, // world from avatar
            ["world_row1"] = 4,
            ["world_row2"] = 4,
            ["world_quat_wxyz"] = 4,
            ["group_matrix_row0"] = 4, // by group: mesh from binding mesh
            ["group_matrix_row1"] = 4,
            ["group_matrix_row2"] = 4,
            ["group_rotation_row0"] = 4,
            ["group_rotation_row1"] = 4,
            ["group_rotation_row2"] = 4,
            ["camera_row0"] = 4, // camera from world
            ["camera_row1"] = 4,
            ["camera_row2"] = 4,
            ["clip_row0"] = 4, // clip from world
            ["clip_row1"] = 4,
            ["clip_row2"] = 4,
            ["clip_row3"] = 4,
            ["eye"] = 4,
            ["tan_half_fov"] = 2,
            ["image_size"] = 2, // pixels
            ["light_ambient0"] = 4, // of the scene: rgb
            ["light_ambient1"] = 4,
            ["light_ambient2"] = 4,
            ["light_ambient3"] = 4,
            ["light_ambient4"] = 4,
            ["light_ambient5"] = 4,
            ["light_ambient6"] = 4,
            ["light_ambient7"] = 4,
            ["light_ambient8"] = 4,
            ["light_place0"] = 4, // of a light: towards it and 0, or its position and 1
            ["light_place1"] = 4,
            ["light_place2"] = 4,
            ["light_place3"] = 4,
            ["light_colour0"] = 4,
            ["light_colour1"] = 4,
            ["light_colour2"] = 4,
            ["light_colour3"] = 4,
            ["light_turn_row0"] = 4, // frame that the light of the capture moves with from world
            ["light_turn_row1"] = 4,
            ["light_turn_row2"] = 4,
            ["shadow_row0"] = 4, // column, row, distance and w of the shadow map, from world
            ["shadow_row1"] = 4,
            ["shadow_row2"] = 4,
            ["shadow_row3"] = 4,
            ["shadow_offset"] = 4, // along the normal, along the light, 1 where there is a shadow map, 0
        };
    }
}
