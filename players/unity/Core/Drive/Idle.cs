using System;

namespace AvatarExport.Core {
    /// <summary>A channel, the number of its curve, and the curve's numbers.</summary>
    public sealed class IdleRow {
        /// <summary>Its name in Arkit.Channels.</summary>
        public readonly string Channel;

        /// <summary>Channels of one number move alike.</summary>
        public readonly int Row;

        /// <summary>As IdleTable says of the table.</summary>
        public readonly double[] Numbers;

        internal IdleRow(string channel, int row, params double[] numbers) {
            Channel = channel;
            Row = row;
            Numbers = numbers;
        }
    }

    /// <summary>
    /// What a person does who only sits there: breathes, blinks, looks about. A function of time and a seed, without
    /// state; the same numbers as avatar_runtime.driving.idle. Nothing repeats, and nothing is allocated.
    /// </summary>
    public static class Idle {
        private const double Degree = Math.PI / 180;

        // Streams of random numbers. A row of Wander has its own, from Rows on.
        private const uint Blinks = 1, Pairs = 2, Shifts = 3, Places = 4, Yaws = 5, DriftYaws = 7, Breaths = 9, Rows = 10;

        private static readonly int[] WanderChannels = ChannelsOf(IdleTable.Wander);
        private static readonly int[] BreathChannels = ChannelsOf(IdleTable.Breath);
        private static readonly int[] Lids = PlacesOf("eyeBlinkLeft", "eyeBlinkRight");
        private static readonly int[][] More = { // to the subject's left; up
            PlacesOf("eyeLookOutLeft", "eyeLookInRight"), PlacesOf("eyeLookUpLeft", "eyeLookUpRight"),
        };
        private static readonly int[][] Less = {
            PlacesOf("eyeLookInLeft", "eyeLookOutRight"), PlacesOf("eyeLookDownLeft", "eyeLookDownRight"),
        };

        /// <summary>Writes the frame at a time, which may be any.</summary>
        public static void Write(double seconds, uint seed, DrivingFrame frame) {
            Array.Clear(frame.Weights, 0, frame.Weights.Length);
            Array.Clear(frame.Head, 0, 3);
            Array.Clear(frame.LeftEye, 0, 3);
            Array.Clear(frame.RightEye, 0, 3);
            Wander(seconds, seed, frame);
            Breathe(seconds, seed, frame);
            Look(seconds, seed, frame);
            float closed = (float)Blink(seconds, seed);
            foreach (int lid in Lids) frame.Weights[lid] = closed;
        }

        private static void Wander(double seconds, uint seed, DrivingFrame frame) {
            for (int i = 0; i < WanderChannels.Length; i++) {
                double[] numbers = IdleTable.Wander[i].Numbers;
                double value = Curve(seconds / numbers[0], seed, Rows + (uint)IdleTable.Wander[i].Row);
                Add(frame, WanderChannels[i], numbers[1], value, 1 + value);
            }
        }

        private static void Breathe(double seconds, uint seed, DrivingFrame frame) {
            double drift = IdleTable.BreathDrift[0] * Curve(seconds / IdleTable.BreathDrift[1], seed, Breaths);
            double breaths = seconds / IdleTable.BreathEveryS + drift, now = breaths - Math.Floor(breaths);
            double sinceIn = now - IdleTable.BreathIn;
            double full = sinceIn < 0 ? Eased(now / IdleTable.BreathIn) : 1 - Eased(sinceIn / IdleTable.BreathOut);
            for (int i = 0; i < BreathChannels.Length; i++) {
                Add(frame, BreathChannels[i], IdleTable.Breath[i].Numbers[0], full, full);
            }
        }

        private static void Add(DrivingFrame frame, int at, double size, double angle, double weight) {
            int shapes = frame.Weights.Length;
            if (at < shapes) frame.Weights[at] = (float)(frame.Weights[at] + size * weight);
            else frame.Head[at - shapes] += size * Degree * angle;
        }

        /// <summary>Shifts the gaze; the head comes after, and the eyes turn back by what the head has turned.</summary>
        private static void Look(double seconds, uint seed, DrivingFrame frame) {
            long now = FixationAt(seconds, seed);
            double saccade = IdleTable.SaccadeS + IdleTable.SaccadeSPerDeg * Distance(now, seed);
            double done = Eased((seconds - Shift(now, seed)) / saccade);
            for (int axis = 0; axis < 2; axis++) {
                double[] wander = IdleTable.GazeWander;
                double drift = wander[1] * Curve(seconds / wander[0], seed, DriftYaws + (uint)axis);
                double last = Target(now - 3, axis, seed), from = last, head = last; // earlier shifts are over
                for (int step = 1; step < 4; step++) {
                    from = last;
                    last = Target(now - 3 + step, axis, seed);
                    double since = seconds - Shift(now - 3 + step, seed) - IdleTable.HeadDelayS;
                    head += Eased(since / IdleTable.HeadTurnS) * (last - from);
                }
                frame.Head[axis] += IdleTable.HeadShare * Degree * head;
                TurnEyes(frame, axis, Degree * (from + done * (last - from) + drift) - frame.Head[axis]);
            }
        }

        /// <summary>Both eyes by an angle in the head, to the subject's left or up, as channels and as weights.</summary>
        private static void TurnEyes(DrivingFrame frame, int axis, double angle) {
            frame.LeftEye[axis] = frame.RightEye[axis] = -angle;
            float weight = (float)Math.Abs(angle / Arkit.RadiansPerEyeWeight);
            foreach (int place in (angle > 0 ? More : Less)[axis]) frame.Weights[place] = weight;
        }

        /// <summary>The number of the fixation that has begun last.</summary>
        private static long FixationAt(double seconds, uint seed) {
            long slot = (long)Math.Floor(seconds / IdleTable.FixationEveryS);
            return seconds >= Shift(slot, seed) ? slot : slot - 1;
        }

        /// <summary>When the gaze starts to shift to a fixation.</summary>
        private static double Shift(long fixation, uint seed) {
            return IdleTable.FixationEveryS * (fixation + IdleTable.FixationWindow * Random(seed, Shifts, fixation));
        }

        /// <summary>Where a fixation looks, degrees: yaw to the subject's left (axis 0), pitch up (1).</summary>
        private static double Target(long fixation, int axis, uint seed) {
            double value = 2 * Random(seed, Yaws + (uint)axis, fixation) - 1;
            bool viewer = Random(seed, Places, fixation) < IdleTable.GazeViewerChance;
            if (viewer) return IdleTable.GazeViewerDeg[axis] * value;
            if (axis == 0) value = 0.6 * value + (value >= 0 ? 0.4 : -0.4);
            return IdleTable.GazeAwayDeg[axis] * value;
        }

        /// <summary>How far the gaze shifts to a fixation, degrees.</summary>
        private static double Distance(long fixation, uint seed) {
            double yaw = Target(fixation, 0, seed) - Target(fixation - 1, 0, seed);
            double pitch = Target(fixation, 1, seed) - Target(fixation - 1, 1, seed);
            return Math.Sqrt(yaw * yaw + pitch * pitch);
        }

        /// <summary>How far the lids are closed.</summary>
        private static double Blink(double seconds, uint seed) {
            long slot = (long)Math.Floor(seconds / IdleTable.BlinkEveryS);
            double since = seconds - BlinkStart(slot, seed);
            bool twice = Random(seed, Pairs, slot) < IdleTable.BlinkPairChance;
            return Closed(since) + (twice ? Closed(since - IdleTable.BlinkPairS) : 0);
        }

        /// <summary>When the blink of a slot starts: with the largest gaze shift of its window, else at random.</summary>
        private static double BlinkStart(long slot, uint seed) {
            double begin = IdleTable.BlinkEveryS * slot, end = begin + IdleTable.BlinkWindow * IdleTable.BlinkEveryS;
            double start = begin + (end - begin) * Random(seed, Blinks, slot), most = IdleTable.BlinkWithGazeDeg;
            for (long at = FixationAt(begin, seed) + 1; Shift(at, seed) < end; at++) {
                double far = Distance(at, seed);
                if (far > most) start = Shift(at, seed);
                most = Math.Max(most, far);
            }
            return start;
        }

        /// <summary>How far a blink has closed the lids, by the seconds since its start.</summary>
        private static double Closed(double since) {
            double opening = since - IdleTable.BlinkCloseS - IdleTable.BlinkClosedS;
            if (opening < 0) return Eased(since / IdleTable.BlinkCloseS);
            double left = 1 - Math.Min(opening / IdleTable.BlinkOpenS, 1);
            return left * left * left * (4 - 3 * left);
        }

        /// <summary>From 0 to 1 with least jerk; held beyond.</summary>
        private static double Eased(double part) {
            double x = Math.Min(Math.Max(part, 0), 1);
            return x * x * x * (10 + x * (6 * x - 15));
        }

        /// <summary>A smooth random curve within -1 and 1: the cubic B-spline of random numbers, one a knot.</summary>
        private static double Curve(double knots, uint seed, uint stream) {
            long knot = (long)Math.Floor(knots);
            double x = knots - knot, y = 1 - x;
            double a = 2 * Random(seed, stream, knot - 1) - 1, b = 2 * Random(seed, stream, knot) - 1;
            double c = 2 * Random(seed, stream, knot + 1) - 1, d = 2 * Random(seed, stream, knot + 2) - 1;
            double middle = (4 - 6 * x * x + 3 * x * x * x) * b + (4 - 6 * y * y + 3 * y * y * y) * c;
            return (y * y * y * a + middle + x * x * x * d) / 6;
        }

        /// <summary>A number from 0 to below 1.</summary>
        private static double Random(uint seed, uint stream, long index) {
            return unchecked(Mixed(Mixed(seed + stream * 0x9e3779b9u) ^ (uint)index)) / 4294967296.0;
        }

        /// <summary>
        /// The finaliser of MurmurHash3 (Appleby, public domain): 32 bits to 32 bits, each of them from all.
        /// </summary>
        private static uint Mixed(uint bits) {
            unchecked {
                bits = (bits ^ bits >> 16) * 0x85ebca6bu;
                bits = (bits ^ bits >> 13) * 0xc2b2ae35u;
                return bits ^ bits >> 16;
            }
        }

        private static int[] PlacesOf(params string[] channels) {
            return Array.ConvertAll(channels, channel => Array.IndexOf(Arkit.Channels, channel));
        }

        private static int[] ChannelsOf(IdleRow[] rows) {
            return Array.ConvertAll(rows, row => Array.IndexOf(Arkit.Channels, row.Channel));
        }
    }
}
