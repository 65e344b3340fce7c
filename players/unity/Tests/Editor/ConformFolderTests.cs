using AvatarExport.Editor;
using NUnit.Framework;

namespace AvatarExport.Tests
{
    /// <summary>The table of Conform names the worst output of each stage, and what is missing.</summary>
    [TestFixture]
    public sealed class ConformFolderTests
    {
        private static Core.ConformRow Row(string stage, string output, double used, bool passed)
        {
            var verdict = new Core.Verdict { Used = used, Passed = passed };
            return new Core.ConformRow { Case = "case of " + output, Stage = stage, Output = output, Verdict = verdict };
        }

        [Test]
        public void TheWorstOfEachStageIsShown()
        {
            var report = new Core.ConformReport();
            report.Rows.Add(Row("blend", "mean", 0.5, true));
            report.Rows.Add(Row("skin", "vertices", 0.25, true));
            report.Rows.Add(Row("blend", "sh", double.NaN, false));
            report.Rows.Add(Row("blend", "quat", 0.75, true));
            report.Rows.Add(Row("skin", "normals", 0.3, true));
            string[] lines = ConformFolder.Table(report).Replace("\r", "").Trim().Split('\n');
            Assert.AreEqual(2, lines.Length);
            Assert.AreEqual("DIFFERS blend      sh               uses NaN % of its tolerance in case case of sh", lines[0]);
            Assert.AreEqual("ok      skin       normals          uses 30 % of its tolerance in case case of normals", lines[1]);
        }

        [Test]
        public void AnotherFolderIsNamed()
        {
            Core.AvatarError error = Assert.Throws<Core.AvatarError>(() => ConformFolder.Run("no such folder", null));
            StringAssert.Contains("no such folder: is no NAME.reference; choose the folder", error.Message);
            error = Assert.Throws<Core.AvatarError>(() => ConformFolder.Run("none.reference", null));
            StringAssert.Contains("none.avatar: cannot be read; choose the folder", error.Message);
        }
    }
}
