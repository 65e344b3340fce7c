using AvatarExport.Core;
using AvatarExport.Editor;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>The table of Conform names the worst output of each stage, and what is missing.</summary>
    public sealed class ConformFolderTests {
        private static ConformRow Row(string stage, string output, double used, bool passed) {
            var verdict = new Verdict { Used = used, Passed = passed };
            return new ConformRow { Case = "case of " + output, Stage = stage, Output = output, Verdict = verdict };
        }

        [Test]
        public void TheWorstOfEachStageIsShown() {
            var report = new ConformReport();
            report.Rows.AddRange(new[] {
                Row("blend", "mean", 0.5, true), Row("skin", "vertices", 0.25, true), Row("blend", "sh", double.NaN, false),
                Row("blend", "quat", 0.75, true), Row("skin", "normals", 0.3, true),
            });
            string[] lines = ConformFolder.Table(report).Replace("\r", "").Trim().Split('\n');
            Assert.AreEqual(2, lines.Length);
            Assert.AreEqual("DIFFERS blend      sh               uses NaN % of its tolerance in case case of sh", lines[0]);
            Assert.AreEqual("ok      skin       normals          uses 30 % of its tolerance in case case of normals", lines[1]);
        }

        [TestCase("no such folder", "no such folder: is no NAME.reference; choose the folder")]
        [TestCase("none.reference", "none.avatar: cannot be read; choose the folder")]
        public void AnotherFolderIsNamed(string folder, string told) {
            StringAssert.Contains(told, Assert.Throws<AvatarError>(() => ConformFolder.Run(folder, null)).Message);
        }
    }
}
