using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>How far one array lies from its reference.</summary>
    public struct Verdict {
        /// <summary>Largest absolute difference, without flips.</summary>
        public double Error;

        /// <summary>Largest share of the tolerance; 1 is the most that passes.</summary>
        public double Used;

        /// <summary>Rows on the other side of a threshold.</summary>
        public int Flips;

        /// <summary>Whether every element is within its tolerance and no more rows flip than may.</summary>
        public bool Passed;
    }

    /// <summary>Compares outputs with the reference, element by element.</summary>
    public static class Judge {
        private const double FlipStep = 4e-3; // of the brightest colour: what a pixel may be off at the cut-off of alpha

        /// <summary>
        /// A verdict for each output of a step, by array. One that is missing or of another length fails.
        /// </summary>
        public static Dictionary<string, Verdict> Of(ConformStep step, Dictionary<string, double[]> got) {
            bool[] apart = DrawnInOne(step, got);
            double brightest = 1;
            double[] rgb;
            if (step.Inputs.TryGetValue("rgb", out rgb)) {
                foreach (double value in rgb) brightest = Math.Max(brightest, Math.Abs(value));
            }
            var verdicts = new Dictionary<string, Verdict>();
            foreach (KeyValuePair<string, Expected> one in step.Outputs) {
                double[] have;
                got.TryGetValue(one.Key, out have);
                verdicts.Add(one.Key, Judged(one.Value, have, apart, brightest));
            }
            return verdicts;
        }

        /// <summary>Rows that either side alone draws; null where nothing is drawn.</summary>
        private static bool[] DrawnInOne(ConformStep step, Dictionary<string, double[]> got) {
            Expected radius;
            double[] have;
            if (!step.Outputs.TryGetValue("radius", out radius) || !got.TryGetValue("radius", out have)) return null;
            if (have.Length != radius.Values.Length) return null;
            var apart = new bool[have.Length];
            for (int i = 0; i < apart.Length; i++) apart[i] = radius.Values[i] > 0 != have[i] > 0;
            return apart;
        }

        private static Verdict Judged(Expected expected, double[] got, bool[] apart, double brightest) {
            double[] want = expected.Values;
            if (got == null || got.Length != want.Length) {
                return new Verdict { Error = double.PositiveInfinity, Used = double.PositiveInfinity };
            }
            var found = new Verdict();
            int width = expected.Rows == 0 ? 0 : want.Length / expected.Rows;
            for (int row = 0; row < expected.Rows; row++) {
                if (expected.Flips != "drawn" && apart != null && apart[row]) continue;
                double atol = expected.Atol * (expected.Weight == null ? 1 : expected.Weight[row]);
                Verdict best = Compared(got, want, row, width, atol, expected.Rtol, 1);
                if (expected.Flips == "sign") {
                    Verdict other = Compared(got, want, row, width, atol, expected.Rtol, -1);
                    if (other.Used < best.Used) best = other;
                }
                if (best.Used > 1 && Flipped(expected, got, row, best.Error, brightest)) {
                    found.Flips++;
                    continue;
                }
                found.Error = Larger(found.Error, best.Error);
                found.Used = Math.Max(found.Used, best.Used);
            }
            found.Passed = found.Used <= 1 && found.Flips <= expected.MostFlips;
            return found;
        }

        private static bool Flipped(Expected expected, double[] got, int row, double error, double brightest) {
            if (expected.Flips == "shadow") return true;
            if (expected.Flips == "drawn") return error == 1 || got[row] == 0 || expected.Values[row] == 0;
            return expected.Flips == "cutoff" && error <= FlipStep * brightest;
        }

        private static Verdict Compared(double[] got, double[] want, int row, int width, double atol, double rtol, double sign) {
            var found = new Verdict();
            for (int i = row * width; i < (row + 1) * width; i++) {
                double off = Math.Abs(sign * got[i] - want[i]), allowed = atol + rtol * Math.Abs(want[i]);
                double share = allowed > 0 ? off / allowed : off == 0 ? 0 : double.PositiveInfinity;
                found.Used = Math.Max(found.Used, double.IsNaN(share) ? double.PositiveInfinity : share);
                found.Error = Larger(found.Error, off);
            }
            return found;
        }

        private static double Larger(double most, double one) => one > most || double.IsNaN(one) ? one : most;
    }
}
