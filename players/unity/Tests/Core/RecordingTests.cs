using System;
using System.Collections.Generic;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>Live Link Face CSV as Python reads it, and what is wrong in one.</summary>
    public sealed class RecordingTests {
        private const string Head = "Timecode,BlendShapeCount,JawOpen,bs_node.eyeBlink_L,headYaw,note";
        private const string Before = Head + "\n10:00:00:01,61,0,0,0,x\n";

        [Test]
        public void ARealRecordingIsPythonsExactAtFramesLinearBetweenAndHoldsAtTheEnds() {
            Recording recording = LiveLinkCsv.Parse(Cases.Text("recording.csv"));
            Dictionary<string, double[]> told = Cases.Tensors("recording.safetensors");
            Assert.AreEqual(told["times"], recording.Times);
            Assert.AreEqual(told["channels"], recording.Channels);
            Assert.AreEqual(told["fps"][0], recording.Fps);
            Assert.AreEqual(300, recording.Times.Length);
            Assert.AreEqual(new string[0], recording.Missing);
            DrivingFrame frame = new DrivingFrame(), want = new DrivingFrame();
            int count = Arkit.Channels.Length;
            Action<double, int> check = (seconds, index) => {
                recording.Sample(seconds, frame);
                want.SetChannels(recording.Channels, count * index);
                Near.Same(want, frame);
            };
            foreach (int index in new[] { 0, 1, 2, 299, 150, 0 }) check(recording.Times[index], index);
            check(-5, 0);
            check(1e6, 299);
            check(double.NaN, 0);
            recording.Sample((recording.Times[1] + recording.Times[2]) / 2, frame);
            want.SetChannels(Enumerable.Range(count, count).Select(c => (recording.Channels[c] + recording.Channels[count + c]) / 2).ToArray(), 0);
            Near.Check(frame.Weights, want.Weights.Select(one => (double)one), 4 * Cases.Rounding, "weights");
            Near.Check(frame.Head, want.Head, 1e-12, "head");
        }

        [Test]
        public void QuotesOtherSpellingsMidnightAndRowsWithoutAFaceAreUnderstood() {
            string[] rows = {
                "\uFEFFTimecode,BlendShapeCount,\"JawOpen\",eyeBlink_L,headYaw,\"a \"\"note\"\"\"",
                "23:59:59:58.5,61,0.25,0.5,0.1,x",
                "23:59:59:59,0,0,0,0,\"no\r\nface\"",
                "",
                "00:00:00:00.000,61, 1e-1 ,-.5,+2.,",
            };
            Recording recording = LiveLinkCsv.Parse(string.Join("\r\n", rows));
            Near.Check(recording.Times, new[] { 0, 1.5 / 60 }, 1e-9, "times");
            Assert.AreEqual(1, recording.WithoutFace);
            Assert.AreEqual(58, recording.Missing.Length);
            Action<string, double, double> check = (name, first, second) => {
                int at = Array.IndexOf(Arkit.Channels, name);
                Assert.AreEqual(new[] { first, second }, new[] { recording.Channels[at], recording.Channels[61 + at] }, name);
            };
            check("jawOpen", 0.25, 0.1);
            check("eyeBlinkLeft", 0.5, -0.5);
            check("headYaw", 0.1, 2);
        }

        [TestCase("10:00:00:01", "10:00:00:03", 2 / 60.0)] // 60 within one second
        [TestCase("10:00:00:01", "10:00:01:03", 1 + 2 / 24.0)]
        [TestCase("10:00:00:01", "10:00:01:24", 1 + 23 / 25.0)]
        public void TheRateIsTheSmallestAboveTheHighestFrame(string first, string second, double seconds) {
            string text = "Timecode,jawOpen\n" + first + ",0\n" + second + ",0";
            Near.Check(LiveLinkCsv.Parse(text).Times, new[] { 0, seconds }, 1e-9, "times");
        }

        [TestCase("", "a.csv: line 1: has no Timecode column")]
        [TestCase("a,b", "a.csv: line 1: has no Timecode column; a Live Link Face CSV is needed")]
        [TestCase("Timecode,jawopn", "line 1: 'Timecode, jawopn' is not an ARKit column")]
        [TestCase("Timecode,jawOpen,JAW_OPEN", "line 1: columns 2 and 3 are both jawOpen")]
        [TestCase(Head, "has no frame with a face")]
        [TestCase(Before + "10:00:00:02,61,0,0", "line 3 has 4 fields, but the header has 6")]
        [TestCase(Before + "10:00:00:02,61,zero,0,0,x", "JawOpen: line 3: 'zero' is not a weight or an angle")]
        [TestCase(Before + "10:00:00:02,61,,0,0,x", "JawOpen: line 3: '' is not")]
        [TestCase(Before + "10:00:00:02,61,0,0,1000,x", "headYaw: line 3: '1000' is not")]
        [TestCase(Before + "10:00:00:02,61,0,0,NaN,x", "headYaw: line 3: 'NaN' is not")]
        [TestCase(Before + "10:00:00,61,0,0,0,x", "Timecode: line 3: '10:00:00' is not a timecode")]
        [TestCase(Before + "25:00:00:00,61,0,0,0,x", "Timecode: line 3: '25:00:00:00' is not a time of day")]
        [TestCase(Before + "\n09:59:59:01,61,0,0,0,\"x\"", "Timecode: line 4 is earlier than the one before")]
        [TestCase(Head + "\n10:00:00:01,61,0,0,0,\"x", "line 2: a quotation mark is not closed")]
        [TestCase(Head + "\n10:00:00:01,61,0,0,0,\"x\"y", "line 2: a comma is missing behind a quotation mark")]
        public void WhatIsWrongIsNamedWithItsLine(string text, string message) {
            StringAssert.Contains(message, Assert.Throws<AvatarError>(() => LiveLinkCsv.Parse(text, "a.csv")).Message);
        }
    }
}
