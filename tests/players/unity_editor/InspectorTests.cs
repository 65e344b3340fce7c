using System.Linq;
using AvatarExport.Core;
using AvatarExport.Editor;
using NUnit.Framework;
using UnityEditor;
using UnityEngine;

namespace AvatarExport.Tests {
    /// <summary>What inspectors draw, by what they ask a stub of Unity to draw.</summary>
    public sealed class InspectorTests {
        [SetUp]
        public void Clear() => EditorGUILayout.Drawn.Clear();

        private static GaussianAvatarAsset Asset(byte[] file) {
            GaussianAvatarAsset asset = ScriptableObject.CreateInstance<GaussianAvatarAsset>();
            asset.name = "asset";
            asset.Bytes = file;
            return asset;
        }

        private static string Drawn() => string.Join("\n", EditorGUILayout.Drawn.ToArray());

        /// <summary>A component, and its inspector.</summary>
        private static GaussianAvatarEditor Inspector(out GaussianAvatar component) {
            component = new GameObject("head").AddComponent<GaussianAvatar>();
            return new GaussianAvatarEditor { target = component };
        }

        [Test]
        public void TheFileSaysWhatIsInIt() {
            new AvatarImporterEditor().Draw(Asset(TestPacks.Bytes("head")));
            StringAssert.Contains("Splats: 12,800", Drawn());
            StringAssert.Contains("held_out: 2.37 s", Drawn());
            Assert.IsFalse(Drawn().Contains("trained from"), "ranges are folded");
        }

        [Test]
        public void AFileThatWasRefusedSaysWhy() {
            GaussianAvatarAsset asset = Asset(TestPacks.Bytes("head"));
            asset.Refuse("face.avatar: is cut off");
            new AvatarImporterEditor().Draw(asset);
            Assert.AreEqual("Error: face.avatar: is cut off", Drawn());
        }

        [Test]
        public void TheComponentHasGroupsOfSlidersAndSaysWhatToDoWithoutAnAvatar() {
            GaussianAvatar component;
            GaussianAvatarEditor editor = Inspector(out component);
            editor.OnInspectorGUI();
            StringAssert.Contains("drag NAME.avatar", Drawn());
            Assert.AreEqual(false, Asked(editor, "HasFrameBounds"));
            component.Asset = Asset(TestPacks.Bytes("head"));
            editor.OnInspectorGUI();
            foreach (string title in new[] { "Brow", "Cheek", "Eye", "Jaw", "Mouth", "Nose", "Other" }) {
                StringAssert.Contains("foldout " + title, Drawn());
            }
            Assert.AreEqual(0, EditorGUILayout.Drawn.Count(line => line.StartsWith("slider")), "groups are folded");
            Assert.AreEqual(true, Asked(editor, "HasFrameBounds"));
            Assert.AreEqual(component.WorldBounds, Asked(editor, "OnGetFrameBounds"));
        }

        /// <summary>Unity finds these methods by their names.</summary>
        private static object Asked(UnityEditor.Editor editor, string method) => editor.GetType().GetMethod(method).Invoke(editor, null);

        [Test]
        public void TheFieldTakesTheFileItself() {
            GaussianAvatar component = WithDragged("prefab", EventType.DragPerform);
            Assert.AreEqual(12800, component.Avatar.Levels[0].Count);
            Assert.AreEqual(EventType.Used, Event.current.type);
        }

        [TestCase("prefab", EventType.DragUpdated, 12)] // not dropped yet
        [TestCase("prefab", EventType.Repaint, 12)]
        [TestCase("prefab", EventType.DragPerform, 500)] // over something else
        [TestCase("cube", EventType.DragPerform, 12)]
        public void NothingElseIsTaken(string what, EventType type, float x) {
            GaussianAvatar component = WithDragged(what, type, x);
            Assert.IsNull(component.Asset);
            bool welcome = type == EventType.DragUpdated;
            Assert.AreEqual(welcome ? DragAndDropVisualMode.Link : DragAndDropVisualMode.None, DragAndDrop.visualMode);
            Assert.AreEqual(welcome ? EventType.Used : type, Event.current.type);
        }

        /// <summary>A component whose inspector was drawn while something was dragged to x, 25; its field is at 10, 20, 200 wide.</summary>
        private static GaussianAvatar WithDragged(string what, EventType type, float x = 12) {
            var dragged = new GameObject(what);
            if (what == "prefab") dragged.AddComponent<GaussianAvatar>().Asset = Asset(TestPacks.Bytes("head"));
            DragAndDrop.objectReferences = new UnityEngine.Object[] { dragged };
            DragAndDrop.visualMode = DragAndDropVisualMode.None;
            Event.current = new Event { type = type, mousePosition = new Vector2(x, 25) };
            GaussianAvatar component;
            Inspector(out component).OnInspectorGUI();
            return component;
        }

        [Test]
        public void AvatarsInScenesShowAFileThatWasImportedAgain() {
            GaussianAvatarAsset asset = Asset(TestPacks.Bytes("joints"));
            var inScene = new GameObject("a").AddComponent<GaussianAvatar>();
            var ofPrefab = new GameObject("b").AddComponent<GaussianAvatar>();
            inScene.Asset = ofPrefab.Asset = asset;
            Resources.Loaded.AddRange(new[] { inScene, ofPrefab });
            EditorUtility.Persistent.Add(ofPrefab);
            asset.Bytes = TestPacks.Bytes("head");
            AvatarReimport.Reload(new[] { "other.avatar" });
            Assert.AreEqual(48, inScene.Avatar.Levels[0].Count);
            AvatarReimport.Reload(new[] { "asset.avatar" });
            Assert.AreEqual(12800, inScene.Avatar.Levels[0].Count);
            Assert.AreEqual(48, ofPrefab.Avatar.Levels[0].Count);
        }

        [Test]
        public void ConformComparesDrivingWithThePackBesideTheFolder() {
            string cases = System.Environment.GetEnvironmentVariable("AVATAR_CASES");
            ConformReport report = ConformFolder.Driving(System.IO.Path.Combine(cases, "driven.reference"));
            Assert.Greater(report.Rows.Count, 10);
            Assert.IsTrue(report.Passed, ConformFolder.Table(report));
        }

        [Test]
        public void SettingsAreRead() {
            ProjectFacts facts = ProjectSettings.Read();
            Assert.AreEqual(Pipeline.BuiltIn, facts.Pipeline);
            Assert.IsTrue(facts.CustomPasses);
            Assert.AreEqual("StandaloneWindows64", facts.Platform);
        }
    }
}
