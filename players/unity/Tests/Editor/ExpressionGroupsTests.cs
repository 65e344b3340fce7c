using System.Linq;
using AvatarExport.Editor;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>Sliders stand in groups by the first word of their names.</summary>
    public sealed class ExpressionGroupsTests {
        [TestCase("jawOpen browDownLeft tongueOut jawLeft mouth_a browInnerUp mouth2 X9", "", "Jaw 0,3; Brow 1,5; Mouth 4,6; Other 2,7")]
        [TestCase("jawOpen browDownLeft tongueOut jawLeft mouth_a browInnerUp mouth2 X9", " LEFT ", "Jaw 3; Brow 1")]
        [TestCase("jawOpen jawLeft", "nothing", "")]
        [TestCase("a", null, "Other 0")]
        public void NamesStandByTheirFirstWordAndASearchDropsTheEmptyGroups(string names, string search, string groups) {
            Assert.AreEqual(groups, string.Join("; ", ExpressionGroups.Of(names.Split(' '), search)
                .Select(group => group.Title + " " + string.Join(",", group.Members.Select(one => one.ToString()).ToArray())).ToArray()));
        }
    }
}
