using System;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>A section of Pose: its first float, and how many items it has.</summary>
    internal struct PoseSection {
        public int First;
        public int Items;
    }

    /// <summary>What passes refer to: buffers, sections found in them, sections of Pose.</summary>
    internal sealed class Held {
        public Dictionary<string, ProgramBuffer> Buffers;
        public readonly Dictionary<string, Packed> Packed = new Dictionary<string, Packed>(NameComparer.Instance);
        public readonly Dictionary<string, PoseSection> Pose = new Dictionary<string, PoseSection>();
    }

    /// <summary>
    /// One pass against the access contract of its entry: what a kernel would read and write, checked before it runs.
    /// It knows no entry, no system and no rule.
    /// </summary>
    internal sealed class Access {
        private const double U32End = 4294967296.0;
        private const string Padding = "unused"; // the member that fills a row of four

        public readonly Contract Contract;
        public readonly string Stage;
        public readonly Pass Pass;
        public readonly Dictionary<string, StorageBuffer> Storage = new Dictionary<string, StorageBuffer>();
        public readonly Dictionary<string, string> Types = new Dictionary<string, string>(); // constant -> "float4"
        public readonly HashSet<string> PackedNames = new HashSet<string>(); // the shader's, of buffers with sections
        private readonly Held held;
        private readonly string place;

        /// <summary>Throws AvatarError unless the entry is known and the pass binds and sets exactly what it declares.</summary>
        public Access(string where, Pass pass, Held held) {
            Pass = pass;
            this.held = held;
            place = where + " (" + Json.Cut(pass.Entry, 40) + ")";
            Interface row;
            if (!Interfaces.All.TryGetValue(pass.Entry, out row) || row.Access == null) {
                throw new AvatarError("is no entry that a program may use; a newer version may know it", null, place);
            }
            Contract = row.Access;
            Stage = row.Stage;
            foreach (StorageBuffer item in row.Storage) Storage.Add(item.Name, item);
            foreach (Member member in row.Members.Where(one => one.Name != Padding)) Types.Add(member.Name, member.Type);
            PackedNames.UnionWith(Contract.Sections.Values.Select(told => told.Buffer));
            CheckNames("buffers", Storage, pass.Buffers);
            CheckNames("constants", Types, pass.Constants);
            CheckBuffers();
        }

        /// <summary>The error for a constant, section or buffer of this pass.</summary>
        public AvatarError Error(string what, string message) => new AvatarError(message, null, place + ", " + what);

        /// <summary>A constant that is a whole number.</summary>
        public double Count(string name) => Pass.Constants[name].Number;

        /// <summary>Whether a part of the contract holds for the constants of this pass.</summary>
        public bool Applies(Conditional told) {
            return told.When.All(one => one.Value.Any(value => value == Count(one.Key)));
        }

        /// <summary>Types and ranges of the constants. Throws AvatarError. Names of the frame are not looked at.</summary>
        public void CheckConstants() {
            foreach (KeyValuePair<string, Constant> one in Pass.Constants) CheckType(one.Key, one.Value);
            foreach (KeyValuePair<string, int[]> one in Contract.Values) {
                if (one.Value.All(value => value != Count(one.Key))) {
                    throw Error(one.Key, Invariant($"{Count(one.Key)} is not known; known are {Listed(one.Value)}"));
                }
            }
            foreach (KeyValuePair<string, long> one in Contract.Most) {
                if (Count(one.Key) < 1 || Count(one.Key) > one.Value) {
                    throw Error(one.Key, Invariant($"is {Count(one.Key)}; 1 to {one.Value} are taken"));
                }
            }
            if (Pass.Rows != Count(Contract.Rows)) {
                throw Error("rows", Invariant($"are {Pass.Rows}; constant {Contract.Rows} is {Count(Contract.Rows)}"));
            }
            foreach (string[] one in Contract.Fits.Where(fit => Number(fit[0]) > Number(fit[1]))) {
                throw Error(one[0], Invariant($"is {Number(one[0])}; {one[1]} is {Number(one[1])}"));
            }
            foreach (KeyValuePair<string, string> one in Contract.Pose) {
                int first = held.Pose[one.Value].First;
                if (Count(one.Key) != first) {
                    throw Error(one.Key, Invariant($"is {Count(one.Key)}; {one.Value} begins at {first}"));
                }
            }
        }

        /// <summary>Numbers as a person reads them.</summary>
        public static string Listed(int[] numbers) {
            return string.Join(", ", numbers.Select(number => number.ToString(CultureInfo.InvariantCulture)).ToArray());
        }

        /// <summary>The value of an expression of the contract.</summary>
        public double Number(string expression) {
            return expression.Split('+').Sum(
                product => product.Split('*').Aggregate(1.0, (value, factor) => value * Factor(factor)));
        }

        /// <summary>Elements of a buffer without sections that the pass touches.</summary>
        public double TouchedElements(string buffer) {
            Touched[] rows;
            if (!Contract.Elements.TryGetValue(buffer, out rows)) return 0;
            return rows.Where(Applies).Select(told => Number(told.Elements)).DefaultIfEmpty(0).Max();
        }

        /// <summary>The section of that name, which must begin where the constant says.</summary>
        public Section Find(string name, string buffer, out Packed packed) {
            string bound = Pass.Buffers[buffer];
            packed = held.Packed[bound];
            Section section = packed.Find(name);
            if (section == null) throw Error(name, "buffer '" + bound + "' has no section of that name");
            if (Count(name) != packed.Offsets[name]) {
                string line = Invariant($"is {Count(name)}; the section begins at word {packed.Offsets[name]}");
                throw Error(name, line);
            }
            return section;
        }

        private void CheckNames<T, TGiven>(string what, Dictionary<string, T> wanted, Dictionary<string, TGiven> given) {
            string missing = First(wanted.Keys.Where(name => !given.ContainsKey(name)));
            string extra = First(given.Keys.Where(name => !wanted.ContainsKey(name)));
            if (missing != null) throw Error(what, missing + " is missing");
            if (extra != null) throw Error(what, "'" + Json.Cut(extra, 80) + "' is not known to this entry");
        }

        private static string First(IEnumerable<string> names) {
            return names.OrderBy(name => name, StringComparer.Ordinal).FirstOrDefault();
        }

        private void CheckBuffers() {
            foreach (KeyValuePair<string, string> one in Pass.Buffers) {
                ProgramBuffer buffer;
                if (!held.Buffers.TryGetValue(one.Value, out buffer)) {
                    throw Error(one.Key, "'" + Json.Cut(one.Value, 80) + "' is no buffer of the program");
                }
                bool isPacked = PackedNames.Contains(one.Key);
                if (buffer.Sections.Length > 0 != isPacked) {
                    string needed = isPacked ? "a buffer with sections" : "a buffer without sections";
                    throw Error(one.Key, "'" + one.Value + "' does not fit; " + needed + " is needed");
                }
            }
        }

        private void CheckType(string name, Constant value) {
            string kind = Types[name];
            bool isNumber = value.Source == null && value.Vector == null;
            if (kind == "uint") {
                double number = isNumber ? value.Number : -1;
                if (!(number >= 0 && number < U32End && number == Math.Floor(number))) {
                    throw Error(name, "is " + Shown(value) + "; a whole number of 32 bits is needed");
                }
            } else if (kind == "float") {
                if (!isNumber || !IsFloat32(value.Number)) {
                    throw Error(name, "is " + Shown(value) + "; a finite float32 is needed");
                }
            } else if (value.Source == null) {
                int floats = kind["float".Length] - '0';
                if (value.Vector == null || value.Vector.Length != floats || !value.Vector.All(IsFloat32)) {
                    throw Error(name, Invariant($"is {Shown(value)}; {floats} finite float32 are needed"));
                }
            }
        }

        private static bool IsFloat32(double value) => Math.Abs(value) <= Packed.MostFloat32;

        private static string Shown(Constant value) {
            if (value.Vector != null) return "a list";
            return value.Source != null ? Json.Shown((object)value.Source) : Json.Shown(value.Number);
        }

        private double Factor(string factor) {
            if (factor[0] >= '0' && factor[0] <= '9') return double.Parse(factor, CultureInfo.InvariantCulture);
            if (factor[0] != '#') return Count(factor);
            string name = factor.Substring(1);
            string section;
            if (Contract.Pose.TryGetValue(name, out section)) return held.Pose[section].Items;
            Packed packed;
            Section found = Find(name, Contract.Sections[name].Buffer, out packed);
            return packed.Rows(found).Last;
        }
    }
}
