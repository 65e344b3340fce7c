using System;
using System.Collections.Generic;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>Changed programs: this checker accepts and refuses what Python's does, and names the same place.</summary>
    public sealed class ProgramTests {
        private Json cases;
        private Json[][] buffers; // name, bytes, sections
        private Section[] sections;
        private Pass[] passes;

        [SetUp]
        public void ReadCases() {
            cases = Cases.Read("programs.json");
            sections = cases.At("sections").List().Select(said => ReadSection(said.List(3, 3))).ToArray();
            buffers = cases.At("buffers").List().Select(said => said.List(3, 3)).ToArray();
            passes = cases.At("passes").List().Select(ReadPass).ToArray();
        }

        [Test]
        public void EveryChangeHasTheVerdictOfPython() {
            Json[] programs = cases.At("programs").List(800);
            Assert.Greater(programs.Count(said => said.At("message").Text() != ""), 40);
            Assert.Greater(programs.Count(said => said.At("field").Value == null), 50);
            foreach (Json said in programs) {
                string message = said.At("message").Text(); // of a planted fault
                AvatarError error = Refusal(said);
                Assert.AreEqual(said.At("field").Value, error == null ? null : error.Field, message);
                string reason = error == null ? "" : error.Reason.Replace("is Infinity", "is inf").Replace("is false", "is False");
                StringAssert.Contains(message, reason);
            }
        }

        private AvatarError Refusal(Json said) {
            try {
                Checker.Check(ReadProgram(said), said.At("groups").Int());
                return null;
            } catch (AvatarError error) {
                Assert.IsFalse(error.Message.Contains("\n"), error.Message);
                Assert.Less(error.Message.Length, 250, error.Message);
                return error;
            }
        }

        private Program ReadProgram(Json said) {
            Json pose = said.At("pose");
            return new Program {
                Buffers = said.At("buffers").List().Select(one => one.List(2, 2))
                    .ToDictionary(one => one[0].Text(), one => ReadBuffer(buffers[one[1].Int()])),
                Mesh = Of(said.At("mesh")),
                Levels = said.At("levels").List().Select(level => new Level {
                    Prefix = level.At("prefix").Text(),
                    Chunks = level.At("chunks").List().Select(run => new Run {
                        First = Clamped(run.At("first")),
                        Count = Clamped(run.At("count")),
                    }).ToArray(),
                    Deform = Of(level.At("deform")),
                    View = Of(level.At("view")),
                    Shadow = Of(level.At("shadow")),
                    Light = Of(level.At("light")),
                }).ToArray(),
                Pose = new PoseSections {
                    Weights = Clamped(pose.At("weights")),
                    Features = Clamped(pose.At("features")),
                    Late = Clamped(pose.At("late")),
                    Joints = Clamped(pose.At("joints")),
                },
                PoseFloats = Clamped(said.At("poseFloats")),
                ReadsMesh = said.At("readsMesh").Flag(),
            };
        }

        private ProgramBuffer ReadBuffer(Json[] said) {
            double bytes = said[1].Number();
            Section[] held = said[2].List().Select(one => sections[one.Int()]).ToArray();
            return new ProgramBuffer(said[0].Text(), bytes == Math.Floor(bytes) ? (long)bytes : -1, held);
        }

        private Pass[] Of(Json listed) => listed.List().Select(one => passes[one.Int()]).ToArray();

        private static Section ReadSection(Json[] said) {
            return new Section(said[0].Text(), new Elements(Convert.FromBase64String(said[2].Text()), said[1].Int()));
        }

        private static Pass ReadPass(Json said) {
            double rows = said.At("rows").Number();
            return new Pass {
                Entry = said.At("entry").Text(),
                Rows = rows == Math.Floor(rows) ? (long)rows : -1,
                Buffers = said.At("buffers").Entries().ToDictionary(one => one.Key, one => one.Value.Text()),
                Constants = said.At("constants").Entries().ToDictionary(one => one.Key, one => ReadConstant(one.Value)),
            };
        }

        private static Constant ReadConstant(Json said) {
            if (said.Value as string == "Infinity") return new Constant { Number = double.PositiveInfinity };
            if (said.Value is string text && text != "NaN") return new Constant { Source = text };
            if (said.Value is List<object>) return new Constant { Vector = said.Numbers() };
            return new Constant { Number = said.Value is double ? (double)said.Value : double.NaN };
        }

        /// <summary>A number as the model holds it. One that it cannot hold becomes one that is refused, too.</summary>
        private static int Clamped(Json said) {
            double value = said.Number();
            return value == Math.Floor(value) ? (int)Math.Max(-1, Math.Min(int.MaxValue, value)) : -1;
        }
    }
}
