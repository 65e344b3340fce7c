using System;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using System.Threading;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>Packs say what a person needs, and errors are short.</summary>
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
                string[] texts = { "-0.5", "1e-3", "9007199254740992", "0.1", "-1.7976931348623157e308" };
                double[] want = { -0.5, 0.001, 9007199254740992, 0.1, double.MinValue };
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
        [TestCase("-0", 0L)]
        [TestCase("-0.0", 0L)]
        [TestCase("-9007199254740992", unchecked((long)0xc340000000000000))]
        [TestCase("0e99999999999", 0L)]
        [TestCase("1e-99999999999", 0L)]
        public void NumbersAreRoundedToTheNearest(string text, long bits) {
            Assert.AreEqual(bits, BitConverter.DoubleToInt64Bits((double)JsonText.Parse(text)));
        }

        [Test]
        public void AJointWithoutAnInverseThroughItsParentsIsRefused() {
            const int joints = 20;
            var arrays = new Dictionary<string, HeldArray>();
            Action<string, string, Array, long[]> add = (name, type, values, shape) => {
                var bytes = new byte[Buffer.ByteLength(values)];
                Buffer.BlockCopy(values, 0, bytes, 0, bytes.Length);
                arrays["rig." + name] = new HeldArray { Type = type, Shape = shape, Elements = new Elements(bytes, 32) };
            };
            float[] small = Enumerable.Range(0, 16 * joints).Select(i => i % 16 == 15 ? 1 : i % 16 % 5 == 0 ? 2e-6f : 0).ToArray();
            add("parents", "i32", Enumerable.Range(-1, joints).ToArray(), new long[] { joints });
            foreach (string name in new[] { "rest_local", "inverse_bind_matrix" }) add(name, "f32", small, new long[] { joints, 4, 4 });
            add("joint_basis", "f32", new float[0], new long[] { 0, joints, 3 });
            add("corrective_joints", "i32", new int[0], new long[] { 0 });
            add("anchor_vertices", "u32", new uint[0], new long[] { 0 });
            string[] names = Enumerable.Range(0, joints).Select(i => "j" + i).ToArray();
            AvatarError error = Assert.Throws<AvatarError>(() => Rig.Read(arrays, names, 0, 0));
            Assert.AreEqual("array rig.rest_local: joint j17 and its parents together have no inverse", error.Message);
            add("parents", "i32", Enumerable.Repeat(-1, joints).ToArray(), new long[] { joints });
            Assert.AreEqual(joints, Rig.Read(arrays, names, 0, 0).Parents.Length);
        }

        [Test]
        public void TextsOfJsonAreRead() {
            Assert.AreEqual("a\"\\/\b\f\n\r\t\u20ac\ud83d\ude00", JsonText.Parse("\"a\\\"\\\\\\/\\b\\f\\n\\r\\t\\u20ac\\ud83d\\ude00\""));
        }

        [Test]
        public void ErrorsAreShortAndShowHiddenLetters() {
            string hidden = "\0\u001b\u007f\u009f\u061c\u200b\u200f\u2028\u202e\u2066\u2069\ufeff";
            var error = new AvatarError(hidden, "\n", "\u0085");
            string shown = "\\u0000\\u001b\\u007f\\u009f\\u061c\\u200b\\u200f\\u2028\\u202e\\u2066\\u2069\\ufeff";
            Assert.AreEqual("\\u000a: \\u0085: " + shown, error.Message);
            Assert.AreEqual("a: \\u0085: " + shown, error.Of("a").Message);
            Assert.AreEqual("\u20ac\u00e9 \ud83d\ude00", AvatarError.Plain("\u20ac\u00e9 \ud83d\ude00"));
            Assert.AreEqual("x", Json.Cut("x\ud83d\ude00", 2));
            Assert.Less(new AvatarError(new string('x', 100000), null, new string('y', 100000)).Message.Length, 1000);
        }
    }
}
