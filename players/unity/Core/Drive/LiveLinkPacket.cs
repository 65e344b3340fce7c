using System;

namespace AvatarExport.Core {
    /// <summary>
    /// UDP packets of the Live Link Face app, version 6, all numbers big-endian: u8 version; device id and subject
    /// name, each a u32 length and UTF-8 text; frame number i32, sub-frame f32, frame rate as numerator i32 and
    /// denominator i32; then, if a face was seen, u8 count (61) and 61 f32 in the order of Arkit.Channels.
    /// </summary>
    public static class LiveLinkPacket {
        private const byte Version = 6;
        private const int MostText = 1024; // bytes of a device id or a subject name
        private const int FrameTime = 16; // bytes
        private const double Most = 100; // weights are in 0..1 and angles in -pi..pi; larger values are refused

        /// <summary>
        /// Takes the face of a packet of "length" bytes. Returns false, and leaves the frame as it is, for a packet
        /// without a face and for one that is not understood to its last byte. Throws nothing and allocates nothing.
        /// </summary>
        public static bool Read(byte[] packet, int length, DrivingFrame into) {
            if (packet == null || length < 1 || length > packet.Length || packet[0] != Version) return false;
            int at = Text(packet, length, 1);
            at = at < 0 ? -1 : Text(packet, length, at);
            if (at < 0 || length - at < FrameTime) return false;
            float subFrame = Number(packet, at + 4);
            if (float.IsNaN(subFrame) || float.IsInfinity(subFrame)) return false;
            if (Whole(packet, at + 8) <= 0 || Whole(packet, at + 12) <= 0) return false;
            at += FrameTime;
            int count = Arkit.Channels.Length;
            if (length - at != 1 + 4 * count || packet[at] != count) return false;
            at++;
            for (int i = 0; i < count; i++) {
                if (!(Math.Abs(Number(packet, at + 4 * i)) <= Most)) return false;
            }
            Take(packet, at, into);
            return true;
        }

        private static void Take(byte[] packet, int at, DrivingFrame into) {
            int shapes = into.Weights.Length;
            for (int i = 0; i < shapes; i++) into.Weights[i] = Number(packet, at + 4 * i);
            at += 4 * shapes;
            for (int i = 0; i < 3; i++) {
                into.Head[i] = Number(packet, at + 4 * i);
                into.LeftEye[i] = Number(packet, at + 12 + 4 * i);
                into.RightEye[i] = Number(packet, at + 24 + 4 * i);
            }
        }

        /// <summary>The first byte behind a text that begins at "at"; -1 if it is not one.</summary>
        private static int Text(byte[] packet, int length, int at) {
            if (length - at < 4) return -1;
            int size = Whole(packet, at);
            at += 4;
            if (size < 0 || size > MostText || size > length - at) return -1;
            return IsUtf8(packet, at, at + size) ? at + size : -1;
        }

        private static bool IsUtf8(byte[] bytes, int at, int end) {
            while (at < end) {
                int more = MoreBytes(bytes[at]);
                if (more < 0 || more >= end - at) return false;
                if (more > 1) {
                    int two = bytes[at] << 8 | bytes[at + 1]; // neither too long, nor a surrogate, nor above U+10FFFF
                    if (two < 0xE0A0 || two >= 0xEDA0 && two < 0xEE00 || two >= 0xF000 && two < 0xF090 || two >= 0xF490) {
                        return false;
                    }
                }
                for (int i = 1; i <= more; i++) {
                    if ((bytes[at + i] & 0xC0) != 0x80) return false;
                }
                at += 1 + more;
            }
            return true;
        }

        /// <summary>Bytes of a letter behind its first one; -1 if none begins so.</summary>
        private static int MoreBytes(byte first) {
            if (first < 0x80) return 0;
            if (first < 0xC2 || first > 0xF4) return -1;
            return first < 0xE0 ? 1 : first < 0xF0 ? 2 : 3;
        }

        private static int Whole(byte[] bytes, int at) {
            return bytes[at] << 24 | bytes[at + 1] << 16 | bytes[at + 2] << 8 | bytes[at + 3];
        }

        /// <summary>A float32 from its bits, without an array.</summary>
        private static float Number(byte[] bytes, int at) {
            int bits = Whole(bytes, at), exponent = bits >> 23 & 0xFF;
            double mantissa = bits & 0x7FFFFF;
            if (exponent == 0xFF) {
                return mantissa != 0 ? float.NaN : bits < 0 ? float.NegativeInfinity : float.PositiveInfinity;
            }
            double value = exponent == 0 ? mantissa * Math.Pow(2, -149) : (mantissa + 0x800000) * Math.Pow(2, exponent - 150);
            return (float)(bits < 0 ? -value : value);
        }
    }
}
