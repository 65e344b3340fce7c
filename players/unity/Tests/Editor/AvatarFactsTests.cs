using System.Collections.Generic;
using System.Linq;
using AvatarExport.Core;
using AvatarExport.Editor;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>The inspector of a file says what a person wants to know.</summary>
    public sealed class AvatarFactsTests {
        [TestCase("head", "Splats", "12,800")]
        [TestCase("head", "Expressions", "51")]
        [TestCase("head", "Bones", "5")]
        [TestCase("head", "Eyelids", "left, right")]
        [TestCase("head", "ARKit input", "yes")]
        [TestCase("head", "Levels", "12,800")]
        [TestCase("head", "Licence", "CC BY 3.0")]
        [TestCase("head", "Consent", "Lee Perry-Smith")]
        [TestCase("surface_without_rig", "Bones", "none")]
        [TestCase("surface_without_rig", "Consent", "not stated")]
        public void AFileSaysWhatIsInIt(string pack, string label, string text) {
            StringAssert.Contains(text, AvatarFacts.Of(TestPacks.Read(pack)).Single(row => row.Key == label).Value);
        }

        [Test]
        public void ClipsHaveTheirLengthsAndExpressionsTheirRanges() {
            LoadedAvatar avatar = TestPacks.Read("head");
            string[] clips = { "held_out: 2.37 s, 30 frames a second", "training: 16.37 s, 30 frames a second" };
            Assert.AreEqual(clips, AvatarFacts.Clips(avatar));
            avatar.Expressions[1].Name = avatar.Clips[0].Name = avatar.Name = "\u202e\n";
            Assert.AreEqual("\\u202e\\u000a", AvatarFacts.Of(avatar)[0].Value);
            StringAssert.Contains("\\u202e\\u000a: 2.37 s", AvatarFacts.Clips(avatar)[0]);
            StringAssert.Contains("\\u202e\\u000a: trained", AvatarFacts.Ranges(avatar)[1]);
            List<string> ranges = AvatarFacts.Ranges(avatar);
            Assert.AreEqual(51, ranges.Count);
            Assert.AreEqual("browDownLeft: trained from 0 to 1", ranges[0]);
        }
    }
}
