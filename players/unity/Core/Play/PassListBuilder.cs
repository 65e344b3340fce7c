using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>
    /// Makes a PassList of passes: names and types of constants come from the interfaces of the shaders.
    /// </summary>
    internal sealed class PassListBuilder {
        private readonly FrameLayout layout; // null: no value of a frame is asked for
        private readonly List<Dispatch> dispatches = new List<Dispatch>();
        private readonly List<float> floats = new List<float>();
        private readonly List<uint> uints = new List<uint>();
        private readonly List<PassList.Copied> copies = new List<PassList.Copied>();
        private readonly List<int> lasting = new List<int>();

        public PassListBuilder(FrameLayout layout) {
            this.layout = layout;
        }

        /// <summary>Thread groups of that many threads each.</summary>
        public static int GroupsOf(long rows, int threads) => (int)((rows + threads - 1) / threads);

        public void Add(Pass one, int groups) {
            Interface told = Interfaces.All[one.Entry];
            var buffers = new List<BufferBinding>();
            foreach (StorageBuffer item in told.Storage) {
                buffers.Add(new BufferBinding { Name = item.Name, Buffer = one.Buffers[item.Name] });
            }
            var slots = new List<ConstantSlot>();
            foreach (Member member in told.Members) {
                Constant value;
                one.Constants.TryGetValue(member.Name, out value); // none for what fills a gap: it is 0
                slots.Add(Slot(member, value));
            }
            Constant width;
            if (one.Entry == "blend" && one.Constants.TryGetValue("appearance_sh_width", out width) && IsZero(width)) {
                lasting.Add(slots.Find(slot => slot.Name == "sh_terms").First);
            }
            dispatches.Add(new Dispatch {
                Entry = one.Entry,
                Stage = told.Stage,
                Groups = groups,
                Buffers = buffers.ToArray(),
                Constants = slots.ToArray(),
            });
        }

        public PassList Build() {
            return new PassList(dispatches.ToArray(), floats.ToArray(), uints.ToArray(), copies.ToArray(), lasting.ToArray());
        }

        private static bool IsZero(Constant value) {
            return value.Source == null && value.Vector == null && value.Number == 0;
        }

        private ConstantSlot Slot(Member member, Constant value) {
            var type = (ConstantType)Enum.Parse(typeof(ConstantType), member.Type, true);
            int first = type == ConstantType.UInt ? uints.Count : floats.Count;
            var slot = new ConstantSlot { Name = member.Name, Type = type, First = first };
            if (type == ConstantType.UInt) {
                uints.Add(value == null ? 0 : (uint)value.Number);
                return slot;
            }
            for (int k = 0; k < (int)type; k++) floats.Add(value == null ? 0 : Literal(value, k));
            if (value != null && value.Source != null) {
                int count;
                int from = layout.Place(value.Source, out count);
                copies.Add(new PassList.Copied { From = from, To = slot.First, Count = count });
            }
            return slot;
        }

        /// <summary>Component k of a literal; 0 of a value of the frame.</summary>
        private static float Literal(Constant value, int k) {
            if (value.Source != null) return 0;
            if (value.Vector != null) return k < value.Vector.Length ? (float)value.Vector[k] : 0;
            return k == 0 ? (float)value.Number : 0;
        }
    }
}
