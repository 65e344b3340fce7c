using System.Collections.Generic;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests
{
    /// <summary>Every pack of the cases loads as Python reads it, bit for bit.</summary>
    [TestFixture]
    public sealed class ContentTests
    {
        [Test]
        public void PacksHoldWhatPythonReads()
        {
            foreach (string name in Cases.Packs())
            {
                Core.Avatar avatar = Cases.Loaded(name);
                Json want = Cases.Read(name, "facts.json");
                CheckBuffers(name, avatar, want.At("buffers"));
                CheckClips(name, avatar, want.At("clips").List());
                CheckSkeleton(name, avatar.Skeleton, want.At("skeleton"));
                object[] expressions = avatar.Expressions
                    .Select(one => new object[] { one.Name, one.Aliases, new[] { one.Low, one.High } }).ToArray();
                Assert.AreEqual(want.At("expressions").Value, expressions, name + " expressions");
                object[] groups = avatar.Groups
                    .Select(one => new object[] { one.Name, one.First, one.Count, one.Binding }).ToArray();
                Assert.AreEqual(want.At("groups").Value, groups, name + " groups");
                Assert.AreEqual(want.At("target").Vector(), avatar.Framing.Whole.Target, name);
                Assert.AreEqual(want.At("low").Vector(), avatar.Bounds.Low, name);
                Assert.AreEqual(want.At("high").Vector(), avatar.Bounds.High, name);
                Assert.AreEqual(Cases.Bytes(name, "pack.avatar").Length, avatar.Bytes, name);
            }
        }

        private static void CheckBuffers(string name, Core.Avatar avatar, Json want)
        {
            Dictionary<string, Json> wanted = want.Entries().ToDictionary(one => one.Key, one => one.Value);
            Assert.AreEqual(wanted.Keys, avatar.Program.Buffers.Keys, name + " buffers");
            foreach (Core.Buffer buffer in avatar.Program.Buffers.Values)
            {
                Json[] sizeAndHash = wanted[buffer.Name].List(2, 2);
                Assert.AreEqual(sizeAndHash[0].Value, buffer.Bytes, name + " " + buffer.Name);
                Assert.AreEqual(sizeAndHash[1].Value, Cases.Sha(buffer.Content()), name + " " + buffer.Name);
            }
        }

        private static void CheckClips(string name, Core.Avatar avatar, Json[] want)
        {
            Assert.AreEqual(want.Length, avatar.Clips.Length, name + " clips");
            for (int i = 0; i < want.Length; i++)
            {
                ClipData clip = avatar.Clips[i];
                Assert.AreEqual(want[i].At("name").Value, clip.Name, name);
                Assert.AreEqual(want[i].At("expressionWeights").Value, Cases.Sha(clip.ExpressionWeights), name);
                Assert.AreEqual(want[i].At("lateWeights").Value, Cases.Sha(clip.LateWeights), name);
                Assert.AreEqual(want[i].At("jointDelta").Value, Cases.Sha(clip.JointDelta), name);
                Assert.AreEqual(want[i].At("worldFromAvatar").Value, Cases.Sha(clip.WorldFromAvatar), name);
            }
        }

        private static void CheckSkeleton(string name, Skeleton skeleton, Json want)
        {
            Assert.AreEqual(want.Value == null, skeleton == null, name + " skeleton");
            if (skeleton == null) return;
            Assert.AreEqual(want.At("names").Value, skeleton.Names, name);
            Assert.AreEqual(want.At("parents").Value, Cases.Sha(skeleton.Parents), name);
            Assert.AreEqual(want.At("restLocal").Value, Cases.Sha(skeleton.RestLocal), name);
            Assert.AreEqual(want.At("inverseBindMatrix").Value, Cases.Sha(skeleton.InverseBindMatrix), name);
            Assert.AreEqual(want.At("jointBasis").Value, Cases.Sha(skeleton.JointBasis), name);
            Assert.AreEqual(want.At("anchorVertices").Value, skeleton.AnchorVertices, name);
        }
    }
}
