using System;
using System.Collections.Generic;
using System.Linq;

namespace AvatarExport.Core {
    /// <summary>Reads the program of a document.</summary>
    internal static class Programs {
        /// <summary>The program, with its buffers, of a document that has the form of packs.</summary>
        public static Program Read(Json said, Dictionary<string, ProgramBuffer> buffers) {
            Json pose = said.At("pose");
            return new Program {
                Buffers = buffers,
                Mesh = Passes(said.At("mesh")),
                Levels = said.At("levels").List().Select(ReadLevel).ToArray(),
                Pose = new PoseSections {
                    Weights = pose.At("weights").Int(),
                    Features = pose.At("features").Int(),
                    Late = pose.At("late").Int(),
                    Joints = pose.At("joints").Int(),
                },
                PoseFloats = said.At("pose_floats").Int(),
                ReadsMesh = said.At("reads_mesh").Flag(),
            };
        }

        private static Level ReadLevel(Json said) {
            return new Level {
                Prefix = said.At("prefix").Text(),
                Chunks = said.At("chunks").List().Select(ReadRun).ToArray(),
                Deform = Passes(said.At("deform")),
                View = Passes(said.At("view")),
                Shadow = said.Optional("shadow", Passes, new Pass[0]),
                Light = said.Optional("light", Passes, new Pass[0]),
            };
        }

        private static Run ReadRun(Json chunk) {
            Json[] ends = chunk.List();
            return new Run { First = ends[0].Int(), Count = ends[1].Int() };
        }

        private static Pass[] Passes(Json said) {
            return said.List().Select(one => new Pass {
                Entry = one.At("entry").Text(),
                Rows = one.At("rows").Whole(),
                Buffers = Record(one.At("buffers"), name => name.Text()),
                Constants = Record(one.At("constants"), ReadConstant),
            }).ToArray();
        }

        private static Dictionary<string, T> Record<T>(Json said, Func<Json, T> read) {
            Dictionary<string, T> found = new Dictionary<string, T>(NameComparer.Instance);
            foreach (KeyValuePair<string, Json> member in said.Entries()) found.Add(member.Key, read(member.Value));
            return found;
        }

        private static Constant ReadConstant(Json said) {
            if (said.Value is string) return new Constant { Source = said.Text() };
            if (!(said.Value is List<object>)) return new Constant { Number = said.Number() };
            return new Constant { Vector = said.List().Select(one => one.Number()).ToArray() };
        }
    }
}
