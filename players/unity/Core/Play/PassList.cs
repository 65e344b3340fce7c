using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>
    /// Dispatches that follow each other, with their constants in two arrays. A dispatch may read what an earlier one
    /// wrote. Set and KeepLasting allocate nothing.
    /// </summary>
    public sealed class PassList {
        /// <summary>In the order in which they run.</summary>
        public readonly Dispatch[] Dispatches;

        /// <summary>All constants of floats.</summary>
        public readonly float[] Floats;

        /// <summary>All constants of whole numbers.</summary>
        public readonly uint[] UInts;

        private readonly Copied[] copies;
        private readonly int[] lasting; // of UInts: sh_terms where no expression changes SH

        internal PassList(Dispatch[] dispatches, float[] floats, uint[] uints, Copied[] copies, int[] lasting) {
            Dispatches = dispatches;
            Floats = floats;
            UInts = uints;
            this.copies = copies;
            this.lasting = lasting;
        }

        /// <summary>
        /// Passes of a program for an avatar of that many groups. Values of the frame are 0 until Set.
        /// </summary>
        public static PassList Of(Program program, IReadOnlyList<Pass> passes, int groups) {
            var made = new PassListBuilder(new FrameLayout(groups));
            foreach (Pass one in passes) made.Add(one, PassListBuilder.GroupsOf(one.Rows, Constants.Threads));
            return made.Build();
        }

        /// <summary>Copies what the frame gives. Returns whether a value has changed.</summary>
        public bool Set(FrameValues values) {
            bool changed = false;
            for (int i = 0; i < copies.Length; i++) {
                Copied one = copies[i];
                for (int k = 0; k < one.Count; k++) {
                    float value = values.Floats[one.From + k];
                    changed |= !(Floats[one.To + k] == value); // NaN is always new
                    Floats[one.To + k] = value;
                }
            }
            return changed;
        }

        /// <summary>
        /// Call it when the dispatches have run once: SH that no expression changes stay in their buffer, and blend, of
        /// whose work they are most, is told that there are none. Returns whether a value has changed.
        /// </summary>
        public bool KeepLasting() {
            bool changed = false;
            for (int i = 0; i < lasting.Length; i++) {
                changed |= UInts[lasting[i]] != 0;
                UInts[lasting[i]] = 0;
            }
            return changed;
        }

        /// <summary>Floats of the frame that are copied to constants.</summary>
        internal struct Copied {
            public int From; // of FrameValues.Floats
            public int To; // of PassList.Floats
            public int Count;
        }
    }
}
