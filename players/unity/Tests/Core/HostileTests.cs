using System;
using System.Diagnostics;
using System.IO;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>Files that nobody should trust: one AvatarError each, no other exception, not long.</summary>
    public sealed class HostileTests {
        private const double MostSeconds = 2; // of CPU time for one file
        private const int MostLetters = 500; // of an error

        [Test]
        public void UnsoundPacksAreRefusedAndNamed() {
            foreach (Json said in Cases.Read("hostile", "hostile.json").List(50)) {
                string what = said.At("what").Text();
                AvatarError error = Refusal(Cases.Bytes("hostile", said.At("file").Text()), what);
                Assert.IsNotNull(error, what + " was taken");
                Assert.AreEqual("a.avatar", error.Owner, what);
                Json field = said.At("field");
                if (!field.IsMissing) Assert.AreEqual(field.Value, error.Field, what + ": " + error.Message);
                StringAssert.Contains(said.At("message").Text(), error.Message, what);
            }
            foreach (Json said in Cases.Read("hostile", "sound.json").List(2)) {
                Assert.IsNull(Refusal(Cases.Bytes("hostile", said.Text()), said.Text()), said.Text());
            }
        }

        [Test]
        public void MutatedPacksAreRefusedOrSound() {
            int loaded = 0, refused = 0;
            double most = 0;
            Process process = Process.GetCurrentProcess();
            using (var files = new BinaryReader(new MemoryStream(Cases.Bytes("mutated.bin")))) {
                while (files.BaseStream.Position < files.BaseStream.Length) {
                    byte[] file = files.ReadBytes(files.ReadInt32());
                    string number = "input " + (loaded + refused);
                    process.Refresh();
                    TimeSpan before = process.TotalProcessorTime;
                    if (Refusal(file, number) == null) loaded++;
                    else refused++;
                    process.Refresh();
                    double seconds = (process.TotalProcessorTime - before).TotalSeconds;
                    Assert.LessOrEqual(seconds, MostSeconds, number);
                    most = Math.Max(most, seconds);
                }
            }
            string line = "mutated packs: {0} loaded, {1} refused; the slowest took {2:F2} s of CPU";
            Console.WriteLine(line, loaded, refused, most);
            Assert.Greater(loaded, (loaded + refused) / 100);
            Assert.Greater(refused, (loaded + refused) / 4);
        }

        /// <summary>The error of a file; null if it loads. Then all that is made of an avatar can be made of it.</summary>
        private static AvatarError Refusal(byte[] file, string what) {
            try {
                LoadedAvatar avatar = LoadedAvatar.Load(file, "a.avatar");
                foreach (ProgramBuffer buffer in avatar.Program.Buffers.Values) {
                    if (buffer.Sections.Length > 0) Assert.AreEqual(buffer.Bytes, 4 * buffer.Content().Length, what);
                }
                ProxyMesh.From(avatar);
                new Poser(avatar).Update(new AvatarPose(avatar));
                return null;
            } catch (AvatarError error) {
                Assert.IsFalse(error.Message.Contains("\n"), what);
                Assert.Less(error.Message.Length, MostLetters, what + ": " + error.Message);
                return error;
            } catch (Exception error) {
                throw new InvalidOperationException(what, error);
            }
        }
    }
}
