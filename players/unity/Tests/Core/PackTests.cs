using System;
using System.Globalization;
using System.Linq;
using System.Threading;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>Packs say what a person needs, and what is no JSON is refused.</summary>
    public sealed class PackTests {
        [Test]
        public void PacksHoldWhatAPersonNeeds() {
            LoadedAvatar avatar = Cases.Golden("joints");
            Assert.AreEqual("Full \u00c4vatar", avatar.Name);
            Assert.AreEqual("right", avatar.Handedness);
            Assert.AreEqual(new[] { 0.25, 0.5, 1 }, avatar.Background);
            Assert.AreEqual(new[] { 48 }, avatar.Levels.Select(one => one.Count));
            Assert.AreEqual(null, avatar.Levels[0].HeightPx);
            Assert.AreEqual("polar3", avatar.Rules["rotation"]);
            LoadedAvatar surface = Cases.Golden("surface_without_rig");
            Assert.IsNull(surface.Skeleton);
            Assert.IsNull(surface.Driving);
            Assert.IsNull(ProxyMesh.From(surface));
            Assert.AreEqual("left", Cases.Loaded("left").Handedness);
            Assert.AreEqual(2, Cases.Loaded("two_levels").Levels.Length);
            Assert.AreEqual(Cases.Read("packs.json").At("shaders").Value, Constants.Shaders);
        }

        [Test]
        public void NumbersOfJsonAreReadInEveryCulture() {
            CultureInfo before = Thread.CurrentThread.CurrentCulture, strange = (CultureInfo)before.Clone();
            strange.NumberFormat.NumberDecimalSeparator = ",";
            strange.NumberFormat.NegativeSign = "minus ";
            try {
                Thread.CurrentThread.CurrentCulture = strange;
                string[] texts = { "-0.5", "1e-3", "123456789012345678", "0.1", "-1.7976931348623157e308", "1e999" };
                double[] want = { -0.5, 0.001, 123456789012345678, 0.1, double.MinValue, double.PositiveInfinity };
                Assert.AreEqual(want, texts.Select(JsonText.Parse).ToArray());
                AvatarError error = Assert.Throws<AvatarError>(() => new Json(-0.5, "$").Whole(-3));
                Assert.AreEqual("$: is -0.5; a whole number of -3 to 4294967295 is needed", error.Message);
            } finally {
                Thread.CurrentThread.CurrentCulture = before;
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
        public void NumbersAreRoundedToTheNearest(string text, long bits) {
            Assert.AreEqual(bits, BitConverter.DoubleToInt64Bits((double)JsonText.Parse(text)));
        }

        [Test]
        public void WhatIsNoJsonIsRefused() {
            string[] texts = {
                "{\"a\":1,\"a\":2}", "[1,]", "[01]", "[1.]", "[.5]", "[+1]", "[-]", "[1e]", "{\"a\" 1}", "{a:1}", "[1 2]", "[true",
                "[truth]", "\"a", "\"\\x\"", "\"\\u12g4\"", "\"\u0001\"", "NaN", "Infinity", "[] []", "", "\u00a0[]",
                new string('[', 1 << 20), "[" + string.Concat(Enumerable.Repeat("0,", 1 << 22).ToArray()) + "0]",
            };
            foreach (string text in texts) {
                Assert.Throws<FormatException>(() => JsonText.Parse(text), text.Substring(0, Math.Min(text.Length, 9)));
            }
            Assert.AreEqual("a\"\\/\b\f\n\r\t\u20ac\ud83d", JsonText.Parse("\"a\\\"\\\\\\/\\b\\f\\n\\r\\t\\u20ac\\ud83d\""));
        }
    }
}
