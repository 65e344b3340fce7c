using System;
using System.Collections.Generic;
using System.Linq;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>What a document says of an avatar without arrays: names, rules, driving, levels, framing.</summary>
    internal static class Facts {
        private const double Margin = 1.08; // of a frame about a box

        /// <summary>Expressions in column order.</summary>
        public static Expression[] Expressions(Json avatar) {
            Expression[] found = avatar.At("expressions").List().Select(ReadExpression).ToArray();
            HashSet<string> names = new HashSet<string>(found.Select(one => one.Name), NameComparer.Instance);
            if (names.Count != found.Length) throw new AvatarError("has a name twice", null, "$.avatar.expressions");
            return found;
        }

        private static Expression ReadExpression(Json said) {
            double[] range = said.At("range").List().Select(end => end.Number()).ToArray();
            string[] aliases = said.Optional("aliases", names => names.Names(), new string[0]);
            return new Expression { Name = said.At("name").Text(), Aliases = aliases, Low = range[0], High = range[1] };
        }

        /// <summary>Rules by name; numbers and other kinds of values are left out.</summary>
        public static Dictionary<string, string> Rules(Json avatar) {
            Dictionary<string, string> found = new Dictionary<string, string>(NameComparer.Instance);
            foreach (KeyValuePair<string, Json> one in avatar.At("rules").Entries()) {
                if (one.Value.Value is string || one.Value.Value == null) found.Add(one.Key, one.Value.Value as string);
            }
            return found;
        }

        /// <summary>The groups of a level of so many rows, which cover its Gaussians in order.</summary>
        public static SplatGroup[] Groups(Json level, long rows) {
            long next = 0;
            List<SplatGroup> groups = new List<SplatGroup>();
            foreach (Json said in level.At("groups").List()) {
                SplatGroup group = ReadGroup(said);
                if (group.First != next) {
                    string line = Invariant($"covers {group.First}+{group.Count}, but row {next} comes next");
                    throw new AvatarError(line, null, said.Path);
                }
                next += group.Count;
                groups.Add(group);
            }
            long count = level.At("count").Whole();
            if (rows != count) throw new AvatarError(Invariant($"is {count}; its chunks have {rows} rows"), null, level.At("count").Path);
            if (rows != next) throw new AvatarError(Invariant($"cover {next} of {rows} Gaussians"), null, level.At("groups").Path);
            return groups.ToArray();
        }

        private static SplatGroup ReadGroup(Json said) {
            IEnumerable<KeyValuePair<string, Json>> mix =
                said.Optional("joint_mix", one => one.Entries(), Enumerable.Empty<KeyValuePair<string, Json>>());
            return new SplatGroup {
                JointMix = mix.Select(one => new KeyValuePair<string, double>(one.Key, one.Value.Number())).ToArray(),
                Name = said.At("name").Text(),
                First = said.At("first").Int(),
                Count = said.At("count").Int(),
                Binding = said.At("binding").One("skin", "anchor", "joint_mix", "surface", "none"),
            };
        }

        /// <summary>The light of the capture, which goes with passes of stage light; or null.</summary>
        public static Relight Relight(Json avatar, Program program, string[] joints) {
            Relight found = avatar.Optional("relight", said => ReadRelight(said, joints ?? new string[0]), null);
            if (program.Levels.Any(level => (level.Light.Length > 0) != (found != null))) {
                string line = "goes with passes of stage light, and they with it";
                throw new AvatarError(line, null, avatar.At("relight").Path);
            }
            return found;
        }

        private static Relight ReadRelight(Json said, string[] joints) {
            foreach (Json row in said.At("ambient").List(9, 9)) {
                if (row.Vector().Any(number => Math.Abs(number) > float.MaxValue)) {
                    throw new AvatarError("has a number beyond float32", null, row.Path);
                }
            }
            bool follows = said.At("frame").Text() == "head";
            string head = said.Optional("joint", one => one.Text(), null);
            Rig.CheckJoint(head, new HashSet<string>(joints), "$.avatar.relight.joint");
            return new Relight {
                Follows = follows,
                Head = follows ? Array.IndexOf(joints, head) : -1,
                Centre = said.At("centre").Vector(),
                Radius = said.At("radius").Number(),
            };
        }

        /// <summary>How ARKit drives the avatar; null if it cannot.</summary>
        public static Driving Driving(Json document) {
            Json avatar = document.At("avatar").At("driving");
            string mode = avatar.At("mode").Text();
            // The manifest's own matrix is in the frame of the pack; `driving` of the document spells out mode "names".
            Json linear = mode == "matrix" ? avatar : document.At("driving");
            if (mode == "none" || linear.IsMissing) return null;
            string[] inputs = linear.At("inputs").Names();
            string[] outputs = linear.At("outputs").Names();
            return new Driving {
                Inputs = inputs,
                Outputs = outputs,
                Matrix = ReadMatrix(linear.At("matrix"), outputs.Length, inputs.Length),
                HeadJoint = avatar.Optional("head_joint", said => said.Text(), null),
                HeadPivot = avatar.Optional("head_pivot", said => said.Vector(), new double[3]),
                LeftEyeJoint = avatar.Optional("left_eye_joint", said => said.Text(), null),
                RightEyeJoint = avatar.Optional("right_eye_joint", said => said.Text(), null),
            };
        }

        private static double[] ReadMatrix(Json said, int rows, int columns) {
            IEnumerable<Json> values = said.List(rows, rows).SelectMany(row => row.List(columns, columns));
            return values.Select(value => (double)(float)value.Number()).ToArray();
        }

        /// <summary>Levels of detail, finest first.</summary>
        public static LevelInfo[] Levels(Json document) {
            return document.At("levels").List().Select((said, index) => new LevelInfo {
                Count = said.At("count").Int(),
                HeightPx = said.Optional("height_px", height => (double?)height.Number(), null),
                PsnrDb = (index == 0 ? document : said).Optional("error", PsnrInMask, null),
            }).ToArray();
        }

        private static double? PsnrInMask(Json error) {
            return error.Optional("psnr_mask_db", psnr => psnr.Optional("mean", mean => (double?)mean.Number(), null), null);
        }

        /// <summary>The box that culling uses, right-handed; or null.</summary>
        public static BoundingBox Bounds(Json avatar, bool left) {
            BoundingBox box = avatar.Optional("bounds", bounds => ReadBox(bounds.At("swept")), null);
            if (box == null || !left) return box;
            double lowest = box.Low[0];
            box.Low[0] = -box.High[0];
            box.High[0] = -lowest;
            return box;
        }

        private static BoundingBox ReadBox(Json said) {
            return new BoundingBox { Low = said.At("min").Vector(), High = said.At("max").Vector() };
        }

        /// <summary>Where to look, right-handed. Without a stated frame, it is the box at rest.</summary>
        public static Framing Framing(Json document, bool left) {
            Framing framing = document.Optional("framing", ReadFraming, new Framing {
                Up = new double[] { 0, 1, 0 },
                Front = new double[] { 0, 0, 1 },
            });
            framing.Whole = framing.Whole ?? AroundRest(document.At("avatar"));
            double[] head = framing.Head == null ? null : framing.Head.Target;
            foreach (double[] vector in new[] { framing.Up, framing.Front, framing.Whole.Target, head }) {
                if (left && vector != null) vector[0] = -vector[0];
            }
            return framing;
        }

        private static Framing ReadFraming(Json said) {
            return new Framing {
                Up = said.At("up").Vector(),
                Front = said.At("front").Vector(),
                Whole = said.Optional("whole", ReadPart, null),
                Head = said.Optional("head", ReadPart, null),
            };
        }

        private static FramedPart ReadPart(Json said) {
            return new FramedPart { Target = said.At("target").Vector(), Size = said.At("size").Vector() };
        }

        private static FramedPart AroundRest(Json avatar) {
            BoundingBox box = avatar.Optional("bounds", bounds => ReadBox(bounds.At("rest")), new BoundingBox {
                Low = new[] { -0.5, -0.5, -0.5 },
                High = new[] { 0.5, 0.5, 0.5 },
            });
            return new FramedPart {
                Target = box.Low.Select((low, i) => (low + box.High[i]) / 2).ToArray(),
                Size = box.Low.Select((low, i) => (box.High[i] - low) * Margin).ToArray(),
            };
        }

        /// <summary>The background of training; null if it was not one colour.</summary>
        public static double[] Background(Json avatar) {
            Json said = avatar.At("background");
            return said.Value is string ? null : said.Vector();
        }
    }
}
