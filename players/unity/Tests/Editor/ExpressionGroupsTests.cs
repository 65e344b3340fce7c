using System.Linq;
using AvatarExport.Editor;
using NUnit.Framework;

namespace AvatarExport.Tests
{
    /// <summary>Sliders stand in groups by the first word of their names.</summary>
    [TestFixture]
    public sealed class ExpressionGroupsTests
    {
        private static readonly string[] Names = { "jawOpen", "browDownLeft", "tongueOut", "jawLeft", "mouth_a", "browInnerUp", "mouth 2", "X9" };

        private static string Text(string search)
        {
            return string.Join("; ", ExpressionGroups.Of(Names, search)
                .Select(group => group.Title + " " + string.Join(",", group.Members.Select(one => one.ToString()).ToArray())).ToArray());
        }

        [Test]
        public void NamesStandByTheirFirstWord()
        {
            Assert.AreEqual("Jaw 0,3; Brow 1,5; Mouth 4,6; Other 2,7", Text(""));
            Assert.AreEqual(Text(""), Text(null));
        }

        [Test]
        public void ASearchKeepsGroupsAndDropsTheEmptyOnes()
        {
            Assert.AreEqual("Jaw 3; Brow 1", Text(" LEFT "));
            Assert.AreEqual("", Text("nothing"));
        }

        [Test]
        public void OneNameIsNoGroup()
        {
            ExpressionGroup[] groups = ExpressionGroups.Of(new[] { "a" }, "");
            Assert.AreEqual(ExpressionGroups.Rest, groups[0].Title);
            Assert.AreEqual(0, ExpressionGroups.Of(new string[0], "").Length);
        }
    }
}
