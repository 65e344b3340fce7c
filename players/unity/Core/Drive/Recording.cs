using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>A recording of a face: frames at rising times. Sampling allocates nothing.</summary>
    public sealed class Recording {
        private const double Whole = 8e-4; // a rate so near to a whole number is that number: clocks of recorders drift
        private const double DefaultFps = 30; // of a single frame

        /// <summary>Seconds from the first frame, [F], rising.</summary>
        public readonly double[] Times;

        /// <summary>Channels of every frame, [F, 61], in the order of Arkit.Channels.</summary>
        public readonly double[] Channels;

        /// <summary>Channels that the file lacks; they are 0 throughout.</summary>
        public readonly string[] Missing;

        /// <summary>How many records had no face and are left out.</summary>
        public readonly int WithoutFace;

        private readonly double[] mixed = new double[Arkit.Channels.Length];
        private int newest; // the frame that was found last

        /// <summary>A recording of frames. Throws AvatarError if there are none.</summary>
        public Recording(double[] times, double[] channels, string[] missing, int withoutFace) {
            if (times.Length == 0 || channels.Length != times.Length * Arkit.Channels.Length) {
                throw new AvatarError("has no frame with a face");
            }
            Times = times;
            Channels = channels;
            Missing = missing;
            WithoutFace = withoutFace;
            Seconds = times[times.Length - 1];
            Fps = RateOf(times);
        }

        /// <summary>Seconds from the first frame to the last.</summary>
        public double Seconds { get; }

        /// <summary>Frames a second, from the median step.</summary>
        public double Fps { get; }

        /// <summary>
        /// Writes the frame at a time, linear between two frames; beyond the ends, the frame at the end.
        /// </summary>
        public void Sample(double seconds, DrivingFrame frame) {
            int count = mixed.Length, at = Find(seconds), next = Math.Min(at + 1, Times.Length - 1);
            double begin = Times[at], step = Times[next] - begin;
            double part = step > 0 ? Math.Min(Math.Max((seconds - begin) / step, 0), 1) : 0;
            if (double.IsNaN(part)) part = 0;
            for (int c = 0; c < count; c++) {
                mixed[c] = (1 - part) * Channels[at * count + c] + part * Channels[next * count + c];
            }
            frame.SetChannels(mixed, 0);
        }

        /// <summary>
        /// The last frame that is not later; the first one if there is none. Times mostly rise from call to call.
        /// </summary>
        private int Find(double seconds) {
            if (!(Times[newest] <= seconds)) newest = 0;
            while (newest + 1 < Times.Length && Times[newest + 1] <= seconds) newest++;
            return newest;
        }

        private static double RateOf(double[] times) {
            var steps = new List<double>();
            for (int i = 1; i < times.Length; i++) {
                if (times[i] > times[i - 1]) steps.Add(times[i] - times[i - 1]);
            }
            if (steps.Count == 0) return DefaultFps;
            steps.Sort();
            int middle = steps.Count / 2;
            double median = steps.Count % 2 == 1 ? steps[middle] : (steps[middle - 1] + steps[middle]) / 2;
            double rate = 1 / median, whole = Math.Floor(rate + 0.5);
            return whole > 0 && Math.Abs(rate / whole - 1) < Whole ? whole : rate;
        }
    }
}
