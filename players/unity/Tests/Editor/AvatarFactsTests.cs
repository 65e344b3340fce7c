using System.Collections.Generic;
using System.Linq;
using AvatarExport.Editor;
using NUnit.Framework;

namespace AvatarExport.Tests
{
    /// <summary>The inspector of a file says what a person wants to know.</summary>
    [TestFixture]
    public sealed class AvatarFactsTests
    {
        private static Dictionary<string, string> Of(Core.Avatar avatar)
        {
            return AvatarFacts.Of(avatar).ToDictionary(row => row.Key, row => row.Value);
        }

        [Test]
        public void TheHeadOfTheSamples()
        {
            Core.Avatar avatar = Core.Pack.Read(TestPacks.Head(), "head");
            Dictionary<string, string> rows = Of(avatar);
            Assert.AreEqual("12,800", rows["Splats"]);
            Assert.AreEqual("51", rows["Expressions"]);
            Assert.AreEqual("5", rows["Bones"]);
            Assert.AreEqual("left, right", rows["Eyelids"]);
            Assert.AreEqual("yes", rows["ARKit input"]);
            Assert.AreEqual("12,800", rows["Levels"]);
            StringAssert.Contains("CC BY 3.0", rows["Licence"]);
            StringAssert.Contains("Lee Perry-Smith", rows["Consent"]);
            Assert.AreEqual(new[] { "held_out: 2.37 s, 30 frames a second", "training: 16.37 s, 30 frames a second" }, AvatarFacts.Clips(avatar));
            Assert.AreEqual(51, AvatarFacts.Ranges(avatar).Count);
            Assert.AreEqual("browDownLeft: trained from 0 to 1", AvatarFacts.Ranges(avatar)[0]);
        }

        [Test]
        public void WhatAFileDoesNotSay()
        {
            Dictionary<string, string> rows = Of(Core.Pack.Read(TestPacks.Golden("surface_without_rig"), "x"));
            Assert.AreEqual("none", rows["Bones"]);
            StringAssert.Contains("not stated", rows["Consent"]);
        }
    }
}
