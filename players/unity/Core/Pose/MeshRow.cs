using System;
using System.Collections.Generic;

namespace AvatarExport.Core
{
    /// <summary>
    /// One vertex in the packed buffers of stage morph or skin: the pass that reads it, and its row there.
    /// </summary>
    internal sealed class MeshRow
    {
        /// <summary>Row of the sections that have one a vertex.</summary>
        public readonly int Row;

        private readonly Pass pass;
        private readonly Dictionary<string, Elements> sections;

        private MeshRow(Pass pass, Buffer held, int row)
        {
            this.pass = pass;
            Row = row;
            sections = new Dictionary<string, Elements>(StringComparer.Ordinal);
            foreach (Section section in held.Sections) sections[section.Name] = section.Elements;
        }

        /// <summary>The row of a vertex. Throws AvatarError if no pass of the entry poses it.</summary>
        public static MeshRow Of(Program program, string entry, string buffer, uint vertex)
        {
            foreach (Pass one in program.Mesh)
            {
                if (one.Entry != entry) continue;
                double row = vertex - one.Constants["first"].Number;
                if (row >= 0 && row < one.Constants["count"].Number)
                {
                    return new MeshRow(one, program.Buffers[one.Buffers[buffer]], (int)row);
                }
            }
            string message = $"no pass poses vertex {vertex}, which an anchor group follows";
            throw new AvatarError(message, null, "array rig.anchor_vertices");
        }

        /// <summary>The elements of a section.</summary>
        public Elements Section(string name)
        {
            return sections[name];
        }

        /// <summary>Writes the neutral position at into[at].</summary>
        public void Template(double[] into, int at)
        {
            int count = (int)pass.Constants["count"].Number, width = Width("template_position");
            Elements section = sections["template_position"];
            Elements scale = width == 32 ? null : sections["template_position_scale"];
            for (int c = 0; c < 3; c++)
            {
                int element = c * count + Row;
                if (scale == null)
                {
                    into[at + c] = section.FloatAt(element);
                    continue;
                }
                uint code = width == 0 ? 0 : section[element];
                float step = (float)((double)scale.FloatAt(2 * c + 1) * code); // rounds as the kernel does
                into[at + c] = (float)((double)scale.FloatAt(2 * c) + step);
            }
        }

        /// <summary>Adds the values of an entry: three channels, or one of skin weights.</summary>
        public void Decode(string name, int entry, int column, List<double> into)
        {
            bool weights = name == "skin_weight";
            int channels = weights ? 1 : 3, width = Width(name);
            Elements section = sections[name];
            Elements steps = width == 0 || width == 32 ? null : sections[name + "_step"];
            for (int c = 0; c < channels; c++)
            {
                int element = channels * entry + c;
                if (width == 0) into.Add(0); // of signed codes the middle, of weights the code 0
                else if (width == 32) into.Add(section.FloatAt(element));
                else
                {
                    double step = steps.FloatAt(weights ? 0 : 3 * column + c);
                    double middle = weights ? 0 : Math.Pow(2, width - 1);
                    into.Add((float)(step * (section[element] - middle)));
                }
            }
        }

        private int Width(string name)
        {
            return (int)pass.Constants[name + "_width"].Number;
        }
    }
}
