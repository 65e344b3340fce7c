using System;
using System.Collections.Generic;
using System.Text.RegularExpressions;

namespace AvatarExport.Core {
    /// <summary>
    /// The 52 ARKit blendshape names and the nine rotation channels that Live Link Face sends after them.
    /// Left and right are the subject's, except in the names of the eye channels.
    /// </summary>
    public static class Arkit {
        /// <summary>ARKit's names [52], in the order of a Live Link Face packet.</summary>
        public static readonly string[] Names = (
            "eyeBlinkLeft eyeLookDownLeft eyeLookInLeft eyeLookOutLeft eyeLookUpLeft eyeSquintLeft eyeWideLeft eyeBlinkRight "
            + "eyeLookDownRight eyeLookInRight eyeLookOutRight eyeLookUpRight eyeSquintRight eyeWideRight jawForward jawRight "
            + "jawLeft jawOpen mouthClose mouthFunnel mouthPucker mouthRight mouthLeft mouthSmileLeft mouthSmileRight "
            + "mouthFrownLeft mouthFrownRight mouthDimpleLeft mouthDimpleRight mouthStretchLeft mouthStretchRight mouthRollLower "
            + "mouthRollUpper mouthShrugLower mouthShrugUpper mouthPressLeft mouthPressRight mouthLowerDownLeft "
            + "mouthLowerDownRight mouthUpperUpLeft mouthUpperUpRight browDownLeft browDownRight browInnerUp browOuterUpLeft "
            + "browOuterUpRight cheekPuff cheekSquintLeft cheekSquintRight noseSneerLeft noseSneerRight tongueOut"
        ).Split(' ');

        /// <summary>All 61 channels: Names, then yaw, pitch and roll of head, leftEye and rightEye.</summary>
        public static readonly string[] Channels = AllChannels();

        /// <summary>Rotation of an eye by one unit of an eyeLook weight, radians.</summary>
        public const double RadiansPerEyeWeight = 0.609;

        private static readonly Dictionary<string, string> Spellings = AllSpellings();
        private static readonly char[] Separators = { '.', ':', '|', '/' };
        private static readonly Regex Prefix = new Regex("^(ak_[0-9]+|arkit|bs)_", RegexOptions.CultureInvariant);
        private static readonly Regex Marks = new Regex("[_\\- ]", RegexOptions.CultureInvariant);

        /// <summary>
        /// The channel that a name spells, or null. Case, underscores, prefixes of tools ("BS_node.", "AK_01_"), "_L"
        /// and "_R" for Left and Right, and the halves of browInnerUp and cheekPuff are understood.
        /// </summary>
        public static string ChannelOf(string name) {
            string[] parts = name.Trim().Split(Separators);
            string plain = Marks.Replace(Prefix.Replace(parts[parts.Length - 1].ToLowerInvariant(), ""), "");
            string found;
            return Spellings.TryGetValue(plain, out found) ? found : null;
        }

        private static string[] AllChannels() {
            var found = new List<string>(Names);
            foreach (string part in new[] { "head", "leftEye", "rightEye" }) {
                foreach (string angle in new[] { "Yaw", "Pitch", "Roll" }) found.Add(part + angle);
            }
            return found.ToArray();
        }

        private static Dictionary<string, string> AllSpellings() {
            var table = new Dictionary<string, string>(StringComparer.Ordinal);
            foreach (string name in Channels) table[name.ToLowerInvariant()] = name;
            foreach (string name in Names) {
                string shorter = Regex.Replace(Regex.Replace(name, "Left$", "L"), "Right$", "R");
                table[shorter.ToLowerInvariant()] = name;
            }
            foreach (string whole in new[] { "browInnerUp", "cheekPuff" }) {
                foreach (string side in new[] { "l", "r", "left", "right" }) {
                    table[whole.ToLowerInvariant() + side] = whole;
                }
            }
            return table;
        }
    }
}
