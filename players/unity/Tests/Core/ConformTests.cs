using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using System.Text;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>The judge, and references that cannot be read. Right ones are played by tests/players/test_unity_played.py.</summary>
    public sealed class ConformTests {
        private static ConformStep Step(string name, Expected expected) {
            var outputs = new Dictionary<string, Expected> { { name, expected } };
            return new ConformStep { Inputs = new Dictionary<string, double[]>(), Outputs = outputs };
        }

        private static double[] Numbers(string text) => text.Split(' ').Select(one => double.Parse(one, CultureInfo.InvariantCulture)).ToArray();

        [TestCase(null, "2 0 0 0", "2.5 0 0 0", 0.5)] // the share of the tolerance that is used
        [TestCase(null, "2 0 0 0", "3 0 0 -0.5", 1)]
        [TestCase(null, "2 0 0 0", "3.01 0 0 0", 9)]
        [TestCase(null, "2 0 0 0", "NaN 0 0 0", 9)]
        [TestCase(null, "2 0 0 0", "Infinity 0 0 0", 9)]
        [TestCase(null, "2 0 0 0", "2 0 0", 9)] // another length
        [TestCase("weight", "0 0 0 0", "0.5 0 5 0", 1)]
        [TestCase("weight", "0 0 0 0", "5 0 0.5 0", 9)]
        [TestCase("sign", "5 -5 0 0", "-5 5 0 0", 0)]
        [TestCase("sign", "5 -5 0 0", "-5 -5 0 0", 9)]
        [TestCase("cutoff", "0 0 0", "0.003 0 0", 0)] // one row may flip
        [TestCase("cutoff", "0 0 0", "0.003 0.003 0", 9)]
        [TestCase("cutoff", "0 0 0", "0.005 0 0", 9)]
        [TestCase("drawn", "7 0 3", "8 0 3", 0)]
        [TestCase("drawn", "7 0 3", "0 0 3", 0)]
        [TestCase("drawn", "7 0 3", "0 4 3", 9)]
        [TestCase("drawn", "7 0 3", "9 0 3", 9)]
        public void AnElementMayUseItsToleranceAndAFewMayFlip(string flips, string want, string got, double used) {
            bool rowwise = flips == "cutoff" || flips == "drawn"; // images and radii: a row a number
            var expected = new Expected {
                Values = Numbers(want),
                Rows = rowwise ? 3 : 2,
                Atol = rowwise ? 0 : 0.5,
                Rtol = rowwise ? 0 : 0.25,
                Weight = flips == "weight" ? new double[] { 1, 10 } : null,
                Flips = flips,
                MostFlips = 1,
            };
            Verdict found = Judge.Of(Step("x", expected), new Dictionary<string, double[]> { { "x", Numbers(got) } })["x"];
            Assert.AreEqual(used <= 1, found.Passed);
            if (used <= 1) Assert.AreEqual(used, found.Used);
        }

        [Test]
        public void RowsThatOneSideAloneDrawsAreNotJudged() {
            ConformStep step = Step("radius", new Expected { Values = new double[] { 2, 0 }, Rows = 2, Flips = "drawn", MostFlips = 1 });
            step.Outputs.Add("depth", new Expected { Values = new double[] { 1, 0 }, Rows = 2 });
            var got = new Dictionary<string, double[]> { { "radius", new double[] { 2, 5 } }, { "depth", new double[] { 1, 9 } } };
            Assert.IsTrue(Judge.Of(step, got).Values.All(one => one.Passed));
            step.Outputs["radius"].MostFlips = 0;
            Assert.IsFalse(Judge.Of(step, got)["radius"].Passed);
            got["depth"][0] = 2;
            Assert.IsFalse(Judge.Of(step, got)["depth"].Passed);
        }

        [TestCase("{'cases':[", "the cases of the reference: is not JSON")]
        [TestCase("{'cases':[{'name':1}]}", "the cases of the reference: $.cases[0].name: is 1; text is needed")]
        [TestCase("{'x':{'tensor':'no'}}", "$.cases[0].stages[0].inputs.x: the vectors have no tensor 'no'")]
        [TestCase("{'x':{'tensor':'t','shape':[3]}}", "tensor 't' has 2 elements, not 3")]
        public void AReferenceThatIsWrongIsNamed(string told, string message) {
            string cases = told.Contains("cases") ? told.Replace('\'', '"') : Case("blend", told);
            StringAssert.Contains(message, Assert.Throws<AvatarError>(() => Reference.Parse(cases, File("[0,8]", 8))).Message);
        }

        [Test]
        public void VectorsThatAreWrongAreNamed() {
            byte[][] files = { new byte[0], new byte[7], new byte[] { 9, 0, 0, 0, 0, 0, 0, 0, 1 }, File("[0,9]", 8), File("[4,3]", 8) };
            foreach (byte[] file in files) {
                AvatarError error = Assert.Throws<AvatarError>(() => Reference.Parse("{\"cases\":[]}", file));
                StringAssert.Contains("the vectors of the reference: ", error.Message);
            }
        }

        [TestCase("blend", "stage blend needs a GPU")]
        [TestCase("joints", "case a, stage joints")]
        [TestCase("driving", "case a, stage driving")]
        public void InputsThatDoNotFitAreNamed(string stage, string message) {
            const string array = "{'tensor':'t','shape':[2]}";
            string cases = Case(stage, "{'expression_weights':" + array + ",'channels':" + array + "}");
            Reference reference = Reference.Parse(cases, File("[0,8]", 8));
            LoadedAvatar avatar = Cases.Loaded("joints");
            StringAssert.Contains(message, Assert.Throws<AvatarError>(() => Conform.Run(avatar, reference, null)).Message);
        }

        private static string Case(string stage, string inputs) {
            string told = "{'cases':[{'name':'a','stages':[{'stage':'" + stage + "','inputs':" + inputs + ",'outputs':{}}]}]}";
            return told.Replace('\'', '"');
        }

        /// <summary>A .safetensors file with a tensor "t" of two float32.</summary>
        private static byte[] File(string offsets, int body) {
            byte[] header = Encoding.UTF8.GetBytes("{\"t\":{\"dtype\":\"F32\",\"shape\":[2],\"data_offsets\":" + offsets + "}}");
            return System.BitConverter.GetBytes((long)header.Length).Concat(header).Concat(new byte[body]).ToArray();
        }
    }
}
