using System.Collections.Generic;
using NUnit.Framework;
using UnityEngine;

namespace AvatarExport.Tests
{
    /// <summary>Single stages, as the reference vectors ask for them.</summary>
    public sealed class StageRunnerTests
    {
        [Test]
        public void AStageReadsAndWritesTheBuffersOfItsNames()
        {
            int before = GraphicsBuffer.Live.Count;
            Core.Avatar avatar = Packs.Read(Packs.Surface);
            Core.Level level = avatar.Program.Levels[0];
            var chunks = new List<Core.ProjectedChunk>();
            for (int i = 0; i < level.Chunks.Length; i++)
            {
                chunks.Add(
                    new Core.ProjectedChunk { Buffer = "0/" + level.Prefix + "Projected." + i,
                    Count = level.Chunks[i].Count });
            }
            Core.SceneSort sort = Core.SceneSort.Of(chunks);
            using (var runner = new GpuStageRunner())
            {
                runner.Load(avatar.Program, sort.Buffers);
                runner.Write("Pairs", new uint[] { 7, 8, 9 });
                var words = new uint[3];
                runner.Read("Pairs", words);
                Assert.AreEqual(9u, words[2]);
                AssertRuns(runner, Core.PassList.Of(avatar.Program, level.Deform, avatar.Groups.Length));
                AssertRuns(runner, sort.Passes);
                Assert.AreEqual(4 * 6 * 5, runner.Draw(sort.Count, 6, 5).Length);
            }
            Assert.AreEqual(before, GraphicsBuffer.Live.Count);
        }

        private static void AssertRuns(GpuStageRunner runner, Core.PassList list)
        {
            for (int i = 0; i < list.Dispatches.Length; i++)
            {
                runner.Run(list, i);
                List<string> entries = Stage.Entries(Graphics.executed);
                Assert.AreEqual(1, entries.Count);
                Assert.AreEqual(list.Dispatches[i].Entry, entries[0]);
            }
        }
    }
}
