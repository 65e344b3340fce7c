using System;
using System.Collections.Generic;
using System.Linq;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>The sections that a pass reads, against the contract of its entry.</summary>
    internal struct AccessSections {
        private const double U32End = 4294967296.0;
        private const double MostScale = 1e30; // of a float that codes are multiplied by: any product is finite
        private readonly Access access;

        private AccessSections(Access access) {
            this.access = access;
        }

        /// <summary>
        /// Throws AvatarError for a section that the kernel would leave. Returns the entries of all pointers together.
        /// </summary>
        public static double Check(Access access) {
            AccessSections sections = new AccessSections(access);
            double entries = 0;
            foreach (KeyValuePair<string, SectionContract> one in access.Contract.Sections) {
                if (!access.Applies(one.Value)) continue;
                sections.CheckSection(one.Key, one.Value);
                if (one.Value.Kind == "pointer") entries += access.Number("#" + one.Key);
            }
            return entries;
        }

        private void CheckSection(string name, SectionContract told) {
            Packed packed;
            Section section = access.Find(name, told.Buffer, out packed);
            double wanted = access.Number(told.Elements);
            double width = told.Width == null ? 32 : access.Count(told.Width);
            if (told.Widths.All(known => known != width)) {
                throw access.Error(told.Width ?? name, Invariant($"is {width}; known are {Access.Listed(told.Widths)}"));
            }
            if (width > 0) {
                CheckLength(name, section, width, wanted);
            } else if (told.Kind != "signed" && wanted > 0 && packed.Offsets[name] >= packed.Words) {
                throw access.Error(name, "begins at the end of its buffer; one word is read at width 0");
            }
            CheckKind(name, told, packed, section, width);
        }

        private void CheckLength(string name, Section section, double width, double wanted) {
            Elements elements = section.Elements;
            if (elements.Bits != width) {
                throw access.Error(name, Invariant($"has elements of {elements.Bits} bits; {width} are stated"));
            }
            if (elements.Length != wanted) {
                throw access.Error(name, Invariant($"has {elements.Length} elements; {wanted} are needed"));
            }
            if (width < 32 && wanted * width >= U32End) {
                string line = Invariant($"has {wanted} elements of {width} bits; their bits exceed a 32-bit index");
                throw access.Error(name, line);
            }
        }

        private void CheckKind(string name, SectionContract told, Packed packed, Section section, double width) {
            if (told.Kind == "pointer") {
                PointerRows rows = packed.Rows(section);
                if (!rows.Rises) throw access.Error(name, "does not begin with 0, or falls");
                if (rows.Longest > told.Pointer) {
                    throw access.Error(name, Invariant($"gives a row {rows.Longest} entries; {told.Pointer} are the most"));
                }
            } else if (told.Kind == "index") {
                CheckBelow(name, packed.Largest(section), access.Number(told.Below));
            } else if (width == 32) {
                if (!packed.IsFinite(section)) throw access.Error(name, "holds a float that is not finite");
            } else {
                CheckScale(name, told, packed, section, width);
            }
        }

        private void CheckBelow(string name, long largest, double end) {
            if (largest >= end) throw access.Error(name, Invariant($"holds {largest}; less than {end} is needed"));
        }

        private void CheckScale(string name, SectionContract told, Packed packed, Section section, double width) {
            Packed same;
            Section floats = access.Find(told.Scale, told.Buffer, out same);
            int length = floats.Elements.Length;
            double wanted = told.Floats == null ? Math.Max(length, 1) : access.Number(told.Floats);
            if (floats.Elements.Bits != 32 || length != wanted) {
                throw access.Error(told.Scale, Invariant($"has {length} elements; {wanted} of 32 bits are needed"));
            }
            if (!packed.IsFinite(floats, MostScale)) {
                throw access.Error(told.Scale, "holds a float that is not finite or exceeds 1e+30");
            }
            if (told.Kind == "table") CheckBelow(name, width > 0 ? packed.Largest(section) : 0, length);
        }
    }
}
