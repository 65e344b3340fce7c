using System;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests
{
    /// <summary>Packs say what a person needs, and what is no JSON is refused.</summary>
    [TestFixture]
    public sealed class PackTests
    {
        [Test]
        public void GoldenPacksHoldWhatAPersonNeeds()
        {
            Core.Avatar avatar = Pack.Read(Cases.Golden("joints"), "joints");
            Assert.AreEqual("Full \u00c4vatar", avatar.Name);
            Assert.AreEqual("right", avatar.Handedness);
            Assert.AreEqual(new[] { 0.25, 0.5, 1 }, avatar.Background);
            Assert.AreEqual(1, avatar.Levels.Length);
            Assert.AreEqual(48, avatar.Levels[0].Count);
            Assert.AreEqual(null, avatar.Levels[0].HeightPx);
            Assert.AreEqual("polar3", avatar.Rules["rotation"]);
            Assert.Less(avatar.Bounds.Low[0], avatar.Bounds.High[0]);
            Core.Avatar surface = Pack.Read(Cases.Golden("surface_without_rig"), "surface");
            Assert.IsNull(surface.Skeleton);
            Assert.IsNull(surface.Driving);
            Assert.IsNull(ProxyMesh.From(surface));
        }

        [Test]
        public void OtherPacksHoldTheirOwn()
        {
            Assert.AreEqual("left", Cases.Loaded("left").Handedness);
            Assert.AreEqual(2, Cases.Loaded("two_levels").Levels.Length);
        }

        [Test]
        public void TheKernelsVersionIsThatOfPython()
        {
            Assert.AreEqual(Cases.Read("packs.json").At("shaders").Value, Constants.Shaders);
        }

        [Test]
        public void NumbersOfJsonAreReadInEveryCulture()
        {
            System.Globalization.CultureInfo before = System.Threading.Thread.CurrentThread.CurrentCulture;
            System.Globalization.CultureInfo strange = (System.Globalization.CultureInfo)before.Clone();
            strange.NumberFormat.NumberDecimalSeparator = ",";
            strange.NumberFormat.NegativeSign = "minus ";
            try
            {
                System.Threading.Thread.CurrentThread.CurrentCulture = strange;
                string[] texts = { "-0.5", "1e-3", "123456789012345678", "0.1", "-1.7976931348623157e308", "1e999" };
                double[] want = { -0.5, 0.001, 123456789012345678, 0.1, double.MinValue, double.PositiveInfinity };
                Assert.AreEqual(want, texts.Select(text => JsonText.Parse(text)).ToArray());
                AvatarError error = Assert.Throws<AvatarError>(() => new Json(-0.5, "$").Whole(-3));
                Assert.AreEqual("$: is -0.5; a whole number of -3 to 4294967295 is needed", error.Message);
            }
            finally
            {
                System.Threading.Thread.CurrentThread.CurrentCulture = before;
            }
        }

        [TestCase("-0.1592862904071808", unchecked((long)0xbfc4637e40000000))]
        [TestCase("-0.1820187265066915", unchecked((long)0xbfc74c63becd8b20))]
        [TestCase("0.60045314147237", 0x3fe336e981aceff2)]
        [TestCase("0.9385958677423489", 0x3fee08fa3383a6f4)]
        [TestCase("3.8120423768821246", 0x400e7f1012dd660e)]
        [TestCase("4.123456789012345e-05", 0x3f059e68f6e45f27)]
        [TestCase("1.2345678901234567E+20", 0x441ac53a7e04bcd9)]
        [TestCase("-0", long.MinValue)]
        [TestCase("0e99999999999", 0L)]
        [TestCase("1e-99999999999", 0L)]
        public void NumbersAreRoundedToTheNearest(string text, long bits)
        {
            Assert.AreEqual(bits, BitConverter.DoubleToInt64Bits((double)JsonText.Parse(text)));
        }

        [TestCase("{\"a\":1,\"a\":2}")]
        [TestCase("[1,]")]
        [TestCase("[01]")]
        [TestCase("[1.]")]
        [TestCase("[.5]")]
        [TestCase("[+1]")]
        [TestCase("[-]")]
        [TestCase("[1e]")]
        [TestCase("{\"a\" 1}")]
        [TestCase("{a:1}")]
        [TestCase("[1 2]")]
        [TestCase("[true")]
        [TestCase("[truth]")]
        [TestCase("\"a")]
        [TestCase("\"\\x\"")]
        [TestCase("\"\\u12g4\"")]
        [TestCase("\"\u0001\"")]
        [TestCase("NaN")]
        [TestCase("Infinity")]
        [TestCase("[] []")]
        [TestCase("")]
        [TestCase("\u00a0[]")]
        public void WhatIsNoJsonIsRefused(string text)
        {
            Assert.Throws<FormatException>(() => JsonText.Parse(text));
        }

        [Test]
        public void DeepAndLongJsonIsRefused()
        {
            Assert.Throws<FormatException>(() => JsonText.Parse(new string('[', 1 << 20)));
            string many = "[" + string.Concat(Enumerable.Repeat("0,", 1 << 22).ToArray()) + "0]";
            Assert.Throws<FormatException>(() => JsonText.Parse(many));
            Assert.AreEqual("a\"\\/\b\f\n\r\t\u20ac\ud83d", JsonText.Parse("\"a\\\"\\\\\\/\\b\\f\\n\\r\\t\\u20ac\\ud83d\""));
        }
    }
}
