using System;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using System.Text.RegularExpressions;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>
    /// Checks a whole program before anything is uploaded: no pass that is accepted leaves its buffers. Every pass is held
    /// to the access contract of its entry. What concerns several passes is here: buffers, the layout of Pose, the order
    /// of passes, chunks, and the work of a frame.
    /// </summary>
    internal sealed class Checker {
        private const long MostBytesInAll = 1L << 32;
        private const int MostPasses = 1 << 14; // of one list
        private const double MostWork = 1 << 28; // rows and entries of one frame of a level
        private const double WorkRatio = 16; // and at most so many a byte of the file
        private const int MostColumns = 1 << 16; // of a section of Pose
        private const int JointFloats = 12;
        private const string Table = "group_"; // names of the frame that begin so have a row a group
        private static readonly string[] HostBuffers = { "Pose", "Mesh" }; // players write them, by these names
        private static readonly string[] ChunkBuffers = { "Splats", "Sh", "Projected" };
        private static readonly Regex Source = new Regex(@"^([a-z0-9_]+)(?:\[([0-9]{1,9})\])?\z");

        private readonly Program program;
        private readonly int groups;
        private readonly double mostWork;
        private readonly Held held;
        private readonly Dictionary<string, string> roles = // buffer without sections -> the one name that shaders give it
            new Dictionary<string, string>(NameComparer.Instance);
        private readonly Dictionary<string, double> touched = // bytes of it that passes touch
            new Dictionary<string, double>(NameComparer.Instance);
        private readonly Dictionary<string, double> agreed = // buffer or entry, constant -> value
            new Dictionary<string, double>(NameComparer.Instance);

        private Checker(Program program, int groups, double bytes) {
            mostWork = Math.Min(MostWork, WorkRatio * bytes);
            this.program = program;
            this.groups = groups;
            held = new Held { Buffers = program.Buffers };
        }

        /// <summary>
        /// Throws AvatarError for a program that would read or write outside its buffers, or work without bound. `groups`
        /// is how many groups of Gaussians the avatar has, `bytes` the size of the file. The field says which pass and which constant, section or buffer.
        /// </summary>
        public static void Check(Program program, int groups, double bytes = double.PositiveInfinity) {
            new Checker(program, groups, bytes).Check();
        }

        private void Check() {
            CheckBuffers();
            CheckPose();
            HashSet<string> written = new HashSet<string>(NameComparer.Instance);
            double work = CheckList("mesh", PassKind.Mesh, program.Mesh, written, null);
            CheckMesh();
            if (program.Levels.Length == 0) throw new AvatarError("there is none", null, "levels");
            for (int index = 0; index < program.Levels.Length; index++) {
                CheckLevel(Invariant($"level {index}"), program.Levels[index], written, work);
            }
            if (program.Levels.Select(level => level.Prefix).Distinct().Count() < program.Levels.Length) {
                throw new AvatarError("two levels have the same prefix", null, "levels");
            }
            CheckSizes();
        }

        private void CheckBuffers() {
            long total = 0;
            foreach (KeyValuePair<string, ProgramBuffer> one in program.Buffers) {
                total += one.Value.Bytes;
                if (one.Value.Sections.Length == 0) continue;
                CheckPacked(one.Value);
                held.Packed.Add(one.Key, new Packed(one.Value));
            }
            if (total > MostBytesInAll) {
                throw new AvatarError(Invariant($"have {total} bytes; {MostBytesInAll} are the most"), null, "buffers");
            }
        }

        private static void CheckPacked(ProgramBuffer buffer) {
            HashSet<string> names = new HashSet<string>();
            foreach (Section section in buffer.Sections) {
                if (!names.Add(section.Name)) {
                    throw new AvatarError("is a duplicate", null, ProgramBuffer.Place(buffer.Name, section.Name));
                }
            }
            long needed = ProgramBuffer.BytesOf(buffer.Sections);
            if (buffer.Bytes != needed) {
                string line = Invariant($"has {buffer.Bytes} bytes; its sections take {needed}");
                throw new AvatarError(line, null, ProgramBuffer.Place(buffer.Name));
            }
        }

        /// <summary>Sections of Pose follow each other without a gap.</summary>
        private void CheckPose() {
            PoseSections pose = program.Pose;
            if (pose.Weights != 0) {
                throw new AvatarError(Invariant($"weights begins at {pose.Weights}, not at 0"), null, "pose");
            }
            CheckPoseSection("weights", pose.Weights, pose.Features, 1);
            CheckPoseSection("features", pose.Features, pose.Late, 1);
            CheckPoseSection("late", pose.Late, pose.Joints, 1);
            CheckPoseSection("joints", pose.Joints, program.PoseFloats, JointFloats);
        }

        private void CheckPoseSection(string name, int first, int end, int floats) {
            long length = (long)end - first;
            if (length < 0 || length > (long)floats * MostColumns || length % floats != 0) {
                throw new AvatarError(Invariant($"{name} takes {length} floats"), null, "pose");
            }
            held.Pose[name] = new PoseSection { First = first, Items = (int)(length / floats) };
        }

        /// <summary>Stage morph moves every vertex once, run after run, and then stage skin where there are joints.</summary>
        private void CheckMesh() {
            if (program.Mesh.Length == 0) return;
            double vertices = program.Mesh[0].Constants["vertices"].Number, at = vertices;
            List<string> entries = new List<string>();
            bool isSound = true;
            foreach (Pass one in program.Mesh) {
                if (at == vertices) {
                    entries.Add(one.Entry);
                    at = 0;
                }
                isSound &= one.Entry == entries.Last() && one.Constants["first"].Number == at;
                at += one.Constants["count"].Number;
            }
            string[] expected = held.Pose["joints"].Items > 0 ? new[] { "morph", "skin" } : new[] { "morph" };
            if (!isSound || at != vertices || !entries.SequenceEqual(expected)) {
                throw new AvatarError("passes do not move every vertex once a stage", null, "mesh");
            }
        }

        private void CheckLevel(string place, Level level, HashSet<string> written, double workBefore) {
            Chunks.Check(place, level);
            HashSet<string> known = new HashSet<string>(written, NameComparer.Instance);
            double work = workBefore + CheckList(place + ", deform", PassKind.Deform, level.Deform, known, level);
            work += CheckList(place + ", view", PassKind.View, level.View, known, level);
            bool isLit = level.Light.Length > 0;
            if (isLit) work += CheckList(place + ", shadow", PassKind.Shadow, level.Shadow, known, level);
            if (isLit) work += CheckList(place + ", light", PassKind.Light, level.Light, known, level);
            if (!isLit && level.Shadow.Length > 0) {
                throw new AvatarError("casts shadows that no pass reads", null, place + ", shadow");
            }
            if (work > mostWork) {
                string line = Invariant($"has {work} rows and entries a frame; {mostWork} are the most");
                throw new AvatarError(line, null, place);
            }
            CheckProjected(place, level);
            if (program.ReadsMesh != level.Deform.Any(one => one.Buffers.ContainsKey("Mesh"))) {
                string said = Json.Shown((object)program.ReadsMesh);
                throw new AvatarError("is " + said + "; the passes of " + place + " differ", null, "reads_mesh");
            }
            CheckPlaced(place, level);
        }

        /// <summary>Every chunk is blended once, and placed: by one pass over the mesh, or by passes that share one buffer.</summary>
        private void CheckPlaced(string place, Level level) {
            ILookup<string, Pass> passes = level.Deform.Where(one => one.Buffers.ContainsKey("Splats"))
                .ToLookup(one => one.Buffers["Splats"], NameComparer.Instance);
            for (int chunk = 0; chunk < level.Chunks.Length; chunk++) {
                string name = Chunks.BufferName(level, "Splats", chunk);
                int blended = passes[name].Count(one => one.Buffers.ContainsKey("BlendStatic"));
                int embedded = passes[name].Count(one => one.Buffers.ContainsKey("EmbedStatic"));
                int skinned = passes[name].Where(one => one.Buffers.ContainsKey("BindStatic"))
                    .Select(one => one.Buffers["BindStatic"]).Distinct().Count();
                bool isPlaced = program.ReadsMesh ? embedded == 1 && skinned == 0 : embedded == 0 && skinned == 1;
                if (blended != 1 || !isPlaced) {
                    throw new AvatarError(name + " is not blended once and placed", null, place + ", deform");
                }
            }
        }

        /// <summary>Every chunk is projected once, and lit once where there is a light.</summary>
        private static void CheckProjected(string place, Level level) {
            Dictionary<string, int> projected = Writers(level.View), lit = Writers(level.Light);
            for (int chunk = 0; chunk < level.Chunks.Length; chunk++) {
                string name = Chunks.BufferName(level, "Projected", chunk);
                CheckOnce(projected, name, place + ", view");
                if (level.Light.Length > 0) CheckOnce(lit, name, place + ", light");
            }
        }

        /// <summary>How many passes write each buffer of projected splats.</summary>
        private static Dictionary<string, int> Writers(Pass[] passes) {
            Dictionary<string, int> times = new Dictionary<string, int>(NameComparer.Instance);
            foreach (Pass one in passes) {
                string bound;
                int before;
                if (!one.Buffers.TryGetValue("Projected", out bound)) continue;
                times.TryGetValue(bound, out before);
                times[bound] = before + 1;
            }
            return times;
        }

        private static void CheckOnce(Dictionary<string, int> times, string name, string place) {
            int count;
            times.TryGetValue(name, out count);
            if (count != 1) throw new AvatarError(Invariant($"{count} passes write {name}; one is needed"), null, place);
        }

        /// <summary>The rows and entries of all passes; buffers that they write join `written`.</summary>
        private double CheckList(string place, PassKind kind, Pass[] passes, HashSet<string> written, Level level) {
            if (passes.Length > MostPasses) {
                throw new AvatarError(Invariant($"has {passes.Length} passes; {MostPasses} are the most"), null, place);
            }
            if (level != null && passes.Length == 0) throw new AvatarError("has no passes", null, place);
            double work = 0;
            int reached = 0;
            for (int index = 0; index < passes.Length; index++) {
                Access access = new Access(Invariant($"{place} pass {index}"), passes[index], held);
                int stage = Array.IndexOf(kind.Stages, access.Stage);
                if (stage < reached || (index == 0 && stage != 0)) {
                    string order = string.Join(", ", kind.Stages);
                    throw access.Error("entry", "stage " + access.Stage + " is out of place; the order is " + order);
                }
                reached = stage;
                access.CheckConstants();
                foreach (KeyValuePair<string, Constant> one in access.Pass.Constants) {
                    if (one.Value.Source != null) CheckSource(access, kind, one.Key, one.Value.Source);
                }
                CheckBound(access, written);
                if (level != null) CheckChunk(access, level, place.Split(',')[0]);
                work += access.Pass.Rows + AccessSections.Check(access);
            }
            return work;
        }

        private void CheckSource(Access access, PassKind kind, string name, string value) {
            Match found = Source.Match(value);
            string source = found.Groups[1].Value;
            bool hasRow = found.Groups[2].Success;
            int floats;
            bool isKnown = FrameSources.Floats.TryGetValue(source, out floats);
            if (!isKnown || !kind.Sources.Any(begin => source.StartsWith(begin, StringComparison.Ordinal))) {
                throw access.Error(name, "'" + Json.Cut(value, 80) + "' is no value of the frame for these passes");
            }
            if (access.Types[name] != Invariant($"float{floats}")) {
                throw access.Error(name, Invariant($"'{value}' has {floats} floats; a {access.Types[name]} is needed"));
            }
            if (hasRow != source.StartsWith(Table, StringComparison.Ordinal)) {
                throw access.Error(name, "'" + value + "' needs " + (hasRow ? "no row" : "a row, NAME[i]"));
            }
            if (hasRow && int.Parse(found.Groups[2].Value, CultureInfo.InvariantCulture) >= groups) {
                throw access.Error(name, Invariant($"'{value}' is beyond the {groups} groups"));
            }
        }

        /// <summary>Buffers without sections: one name each, written before they are read, large enough, agreed upon.</summary>
        private void CheckBound(Access access, HashSet<string> written) {
            foreach (KeyValuePair<string, string> one in access.Pass.Buffers) {
                if (access.PackedNames.Contains(one.Key)) continue;
                CheckRole(access, one.Key, one.Value, written);
                double bytes = access.Storage[one.Key].Stride * access.TouchedElements(one.Key);
                double before;
                touched.TryGetValue(one.Value, out before);
                touched[one.Value] = Math.Max(before, bytes);
                int has = program.Buffers[one.Value].Bytes;
                if (bytes > has) throw access.Error(one.Key, Invariant($"takes {bytes} bytes; '{one.Value}' has {has}"));
            }
            foreach (KeyValuePair<string, string[]> one in access.Contract.Same) {
                Agree(access, access.Pass.Buffers[one.Key], one.Value);
            }
            written.UnionWith(
                access.Storage.Values.Where(item => !item.IsReadOnly).Select(item => access.Pass.Buffers[item.Name]));
        }

        private void CheckRole(Access access, string name, string bound, HashSet<string> written) {
            string role;
            if (!roles.TryGetValue(bound, out role)) roles[bound] = role = name;
            if (role != name) throw access.Error(name, "'" + bound + "' is bound as " + role + " elsewhere");
            if (HostBuffers.Contains(name) && bound != name) {
                throw access.Error(name, "is bound to '" + bound + "'; players write buffer '" + name + "'");
            }
            if (access.Storage[name].IsReadOnly && !written.Contains(bound) && name != "Pose") {
                throw access.Error(name, "no earlier pass writes '" + bound + "'");
            }
        }

        private void Agree(Access access, string what, string[] constants) {
            foreach (string constant in constants) {
                string key = what + "\n" + constant;
                double value = access.Count(constant);
                double first;
                if (!agreed.TryGetValue(key, out first)) agreed[key] = first = value;
                if (first != value) {
                    throw access.Error(constant, Invariant($"is {value}; an earlier pass over {what} has {first}"));
                }
            }
        }

        private void CheckChunk(Access access, Level level, string place) {
            Agree(access, place + " (" + access.Pass.Entry + ")", access.Contract.Level);
            string constant = access.Contract.Chunk;
            if (constant == null) return;
            int chunk = -1;
            foreach (string kind in ChunkBuffers) {
                string bound;
                if (!access.Pass.Buffers.TryGetValue(kind, out bound)) continue;
                int index = Chunks.IndexOf(level, kind, bound);
                if (index < 0 || (chunk >= 0 && chunk != index)) {
                    throw access.Error(kind, "'" + bound + "' is no buffer of this chunk");
                }
                chunk = index;
            }
            if (chunk >= 0 && access.Count(constant) != level.Chunks[chunk].Count) {
                int rows = level.Chunks[chunk].Count;
                throw access.Error(constant, Invariant($"is {access.Count(constant)}; chunk {chunk} has {rows} rows"));
            }
        }

        /// <summary>Buffers without sections are as large as what is touched, so that a small file takes little memory.</summary>
        private void CheckSizes() {
            ProgramBuffer poseBuffer;
            if (program.Buffers.TryGetValue("Pose", out poseBuffer) && poseBuffer.Sections.Length == 0) {
                touched["Pose"] = ProgramBuffer.Word * (double)program.PoseFloats;
            }
            foreach (KeyValuePair<string, ProgramBuffer> one in program.Buffers.Where(one => one.Value.Sections.Length == 0)) {
                double needed;
                touched.TryGetValue(one.Key, out needed);
                if (one.Value.Bytes != needed) {
                    string line = Invariant($"has {one.Value.Bytes} bytes; passes touch {needed}");
                    throw new AvatarError(line, null, ProgramBuffer.Place(one.Key));
                }
            }
        }
    }

    /// <summary>A list of passes: the stages that it may have, and what of the frame it may ask for.</summary>
    internal sealed class PassKind {
        public static readonly PassKind Mesh = new PassKind(new[] { "morph", "skin" });
        public static readonly PassKind Deform = new PassKind(new[] { "blend", "bind", "activate" }, "world_", "group_");
        public static readonly PassKind View =
            new PassKind(new[] { "project" }, "camera_", "clip_", "eye", "tan_half_fov", "image_size");
        public static readonly PassKind Shadow = new PassKind(new[] { "shadow" }, "shadow_row", "world_row");
        public static readonly PassKind Light = new PassKind(new[] { "light" }, "light_", "shadow_", "world_quat");

        public readonly string[] Stages; // in their order
        public readonly string[] Sources; // beginnings of names of the frame

        private PassKind(string[] stages, params string[] sources) {
            Stages = stages;
            Sources = sources;
        }
    }
}
