using System;
using System.Collections.Generic;
using System.Linq;
using NUnit.Framework;

namespace AvatarExport.Tests
{
    /// <summary>Compares arrays of numbers.</summary>
    internal static class Near
    {
        /// <summary>Every number is within the limit of the wanted one.</summary>
        public static void Check(IEnumerable<double> got, IEnumerable<double> want, double limit, string what)
        {
            double[] have = got.ToArray(), wanted = want.ToArray();
            Assert.AreEqual(wanted.Length, have.Length, what);
            for (int i = 0; i < have.Length; i++)
            {
                if (Math.Abs(have[i] - wanted[i]) <= limit) continue;
                Assert.Fail(what + "[" + i + "] is " + have[i] + ", not " + wanted[i] + "; " + limit + " is allowed");
            }
        }

        /// <summary>The same of float32.</summary>
        public static void Check(IEnumerable<float> got, IEnumerable<double> want, double limit, string what)
        {
            Check(got.Select(one => (double)one), want, limit, what);
        }

        /// <summary>The largest size of a number, at least 1.</summary>
        public static double Largest(IEnumerable<double> values)
        {
            return values.Select(one => Math.Abs(one)).Concat(new[] { 1.0 }).Max();
        }

        /// <summary>Row t of a tensor.</summary>
        public static double[] At(this Tensor tensor, int t)
        {
            return tensor.Values.Skip(t * tensor.Row).Take(tensor.Row).ToArray();
        }

        /// <summary>Row t of a tensor into an array of float32.</summary>
        public static void Fill(this Tensor tensor, int t, float[] into)
        {
            for (int i = 0; i < into.Length; i++) into[i] = (float)tensor.Values[t * tensor.Row + i];
        }

        /// <summary>Row t of a tensor into an array of float64.</summary>
        public static void Fill(this Tensor tensor, int t, double[] into)
        {
            for (int i = 0; i < into.Length; i++) into[i] = tensor.Values[t * tensor.Row + i];
        }
    }
}
