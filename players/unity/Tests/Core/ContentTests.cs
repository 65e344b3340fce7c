using System;
using System.Collections.Generic;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>Every pack of the cases loads as Python reads it, bit for bit.</summary>
    public sealed class ContentTests {
        [Test]
        public void PacksHoldWhatPythonReads() {
            foreach (string name in Cases.Packs()) {
                LoadedAvatar avatar = Cases.Loaded(name);
                Json want = Cases.Read(name, "facts.json");
                Action<string, object> check = (what, got) => Assert.AreEqual(Flat(want.At(what).Value), got, name + " " + what);
                check("buffers", avatar.Program.Buffers.Values.SelectMany(
                    one => new object[] { one.Name, new object[] { one.Bytes, Cases.Sha(one.Content()) } }));
                check("clips", avatar.Clips.Select(one => new object[] {
                    "name", one.Name, "expressionWeights", Cases.Sha(one.ExpressionWeights), "lateWeights", Cases.Sha(one.LateWeights),
                    "jointDelta", Cases.Sha(one.JointDelta), "worldFromAvatar", Cases.Sha(one.WorldFromAvatar),
                }));
                Skeleton rig = avatar.Skeleton;
                check("skeleton", rig == null ? null : new object[] {
                    "names", rig.Names, "parents", Cases.Sha(rig.Parents), "restLocal", Cases.Sha(rig.RestLocal),
                    "inverseBindMatrix", Cases.Sha(rig.InverseBindMatrix), "jointBasis", Cases.Sha(rig.JointBasis),
                    "anchorVertices", rig.AnchorVertices,
                });
                check("expressions", avatar.Expressions.Select(one => new object[] { one.Name, one.Aliases, new[] { one.Low, one.High } }));
                check("groups", avatar.Groups.Select(one => new object[] { one.Name, one.First, one.Count, one.Binding }));
                check("target", avatar.Framing.Whole.Target);
                check("low", avatar.Bounds.Low);
                check("high", avatar.Bounds.High);
                Assert.AreEqual(Cases.Bytes(name, "pack.avatar").Length, avatar.Bytes, name);
            }
        }

        /// <summary>Objects as lists of names and values; "anchors" are another test's.</summary>
        private static object Flat(object said) {
            if (said is List<object> list) return list.Select(Flat);
            var members = said as Dictionary<string, object>;
            return members == null ? said : members.Where(one => one.Key != "anchors").SelectMany(one => new[] { one.Key, Flat(one.Value) });
        }
    }
}
