using System.Collections.Generic;
using System.Linq;
using System.Text;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests
{
    /// <summary>
    /// The judge, and references that cannot be read. Right ones are played by tests/players/test_unity_played.py.
    /// </summary>
    [TestFixture]
    public sealed class ConformTests
    {
        private static Verdict Judged(Expected expected, params double[] got)
        {
            var step = new ConformStep
            {
                Inputs = new Dictionary<string, double[]>(),
                Outputs = new Dictionary<string, Expected> { { "x", expected } },
            };
            return Judge.Of(step, new Dictionary<string, double[]> { { "x", got } })["x"];
        }

        private static Expected Want(string flips, params double[] values)
        {
            return new Expected { Values = values, Rows = values.Length / 2, Atol = 0.5, Rtol = 0.25, Flips = flips, MostFlips = 1 };
        }

        [Test]
        public void AnElementMayUseItsTolerance()
        {
            Assert.AreEqual(0.5, Judged(Want(null, 2, 0, 0, 0), 2.5, 0, 0, 0).Used);
            Assert.IsTrue(Judged(Want(null, 2, 0, 0, 0), 3, 0, 0, -0.5).Passed);
            Assert.IsFalse(Judged(Want(null, 2, 0, 0, 0), 3.01, 0, 0, 0).Passed);
            Assert.IsFalse(Judged(Want(null, 2, 0, 0, 0), double.NaN, 0, 0, 0).Passed);
            Assert.IsFalse(Judged(Want(null, 2, 0, 0, 0), double.PositiveInfinity, 0, 0, 0).Passed);
            Assert.IsFalse(Judged(Want(null, 2, 0, 0, 0), 2, 0, 0).Passed, "another length");
            Expected weighed = Want(null, 0, 0, 0, 0);
            weighed.Weight = new double[] { 1, 10 };
            Assert.IsTrue(Judged(weighed, 0.5, 0, 5, 0).Passed);
            Assert.IsFalse(Judged(weighed, 5, 0, 0.5, 0).Passed);
        }

        [Test]
        public void FlipsAreCountedAndAFewMayBe()
        {
            Assert.AreEqual(0, Judged(Want("sign", 5, -5, 0, 0), -5, 5, 0, 0).Used);
            Assert.IsFalse(Judged(Want("sign", 5, -5, 0, 0), -5, -5, 0, 0).Passed);
            Expected image = new Expected { Values = new double[] { 0, 0, 0 }, Rows = 3, Flips = "cutoff", MostFlips = 1 };
            Assert.IsTrue(Judged(image, 0.003, 0, 0).Passed);
            Assert.IsFalse(Judged(image, 0.003, 0.003, 0).Passed);
            Assert.IsFalse(Judged(image, 0.005, 0, 0).Passed);
            Expected drawn = new Expected { Values = new double[] { 7, 0, 3 }, Rows = 3, Flips = "drawn", MostFlips = 1 };
            Assert.IsTrue(Judged(drawn, 8, 0, 3).Passed);
            Assert.IsTrue(Judged(drawn, 0, 0, 3).Passed);
            Assert.IsFalse(Judged(drawn, 0, 4, 3).Passed);
            Assert.IsFalse(Judged(drawn, 9, 0, 3).Passed);
        }

        [Test]
        public void RowsThatOneSideAloneDrawsAreNotJudged()
        {
            var step = new ConformStep
            {
                Inputs = new Dictionary<string, double[]>(),
                Outputs = new Dictionary<string, Expected>
                {
                    { "radius", new Expected { Values = new double[] { 2, 0 }, Rows = 2, Flips = "drawn", MostFlips = 1 } },
                    { "depth", new Expected { Values = new double[] { 1, 0 }, Rows = 2 } },
                },
            };
            var got = new Dictionary<string, double[]> { { "radius", new double[] { 2, 5 } }, { "depth", new double[] { 1, 9 } } };
            Assert.IsTrue(Judge.Of(step, got).Values.All(one => one.Passed));
            step.Outputs["radius"].MostFlips = 0;
            Assert.IsFalse(Judge.Of(step, got)["radius"].Passed);
            got["depth"][0] = 2;
            Assert.IsFalse(Judge.Of(step, got)["depth"].Passed);
        }

        [TestCase("{\"cases\":[", "the cases of the reference: is not JSON")]
        [TestCase("{\"cases\":[{\"name\":1}]}", "the cases of the reference: $.cases[0].name: is 1; text is needed")]
        [TestCase(
            "{\"cases\":[{\"name\":\"a\",\"stages\":[{\"stage\":\"b\",\"inputs\":{\"x\":{\"tensor\":\"no\"}},\"outputs\":{}}]}]}",
            "$.cases[0].stages[0].inputs.x: the vectors have no tensor 'no'")]
        [TestCase(
            "{\"cases\":[{\"name\":\"a\",\"stages\":[{\"stage\":\"b\",\"inputs\":{\"x\":{\"tensor\":\"t\",\"shape\":[3]}},\"outputs\":{}}]}]}",
            "tensor 't' has 2 elements, not 3")]
        public void AReferenceThatIsWrongIsNamed(string cases, string message)
        {
            AvatarError error = Assert.Throws<AvatarError>(() => Reference.Parse(cases, File("[0,8]", 8)));
            StringAssert.Contains(message, error.Message);
        }

        [Test]
        public void VectorsThatAreWrongAreNamed()
        {
            foreach (byte[] file in new[] { new byte[0], new byte[7], new byte[] { 9, 0, 0, 0, 0, 0, 0, 0, 1 }, File("[0,9]", 8), File("[4,3]", 8) })
            {
                AvatarError error = Assert.Throws<AvatarError>(() => Reference.Parse("{\"cases\":[]}", file));
                StringAssert.Contains("the vectors of the reference: ", error.Message);
            }
        }

        [Test]
        public void StagesThatNothingRunsAreRefused()
        {
            Core.Avatar avatar = Cases.Loaded("joints");
            string cases = "{\"cases\":[{\"name\":\"a\",\"stages\":[{\"stage\":\"blend\",\"inputs\":{},\"outputs\":{}}]}]}";
            AvatarError error = Assert.Throws<AvatarError>(() => Conform.Run(avatar, Reference.Parse(cases, File("[0,8]", 8)), null));
            StringAssert.Contains("stage blend needs a GPU", error.Message);
        }

        [TestCase("joints")]
        [TestCase("driving")]
        public void InputsThatDoNotFitAreNamed(string stage)
        {
            string array = "{\"tensor\":\"t\",\"shape\":[2]}";
            string inputs = "{\"expression_weights\":" + array + ",\"channels\":" + array + "}";
            string cases = "{\"cases\":[{\"name\":\"a\",\"stages\":[{\"stage\":\"" + stage + "\",\"inputs\":" + inputs
                + ",\"outputs\":{}}]}]}";
            Reference reference = Reference.Parse(cases, File("[0,8]", 8));
            AvatarError error = Assert.Throws<AvatarError>(() => Conform.Run(Cases.Loaded("joints"), reference, null));
            Assert.AreEqual("case a, stage " + stage, error.Field);
        }

        /// <summary>A .safetensors file with a tensor "t" of two float32.</summary>
        private static byte[] File(string offsets, int body)
        {
            byte[] header = Encoding.UTF8.GetBytes("{\"t\":{\"dtype\":\"F32\",\"shape\":[2],\"data_offsets\":" + offsets + "}}");
            return System.BitConverter.GetBytes((long)header.Length).Concat(header).Concat(new byte[body]).ToArray();
        }
    }
}
