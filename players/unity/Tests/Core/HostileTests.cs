using System;
using System.Collections.Generic;
using System.Diagnostics;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests
{
    /// <summary>Files that nobody should trust: one AvatarError each, no other exception, not long.</summary>
    [TestFixture]
    public sealed class HostileTests
    {
        private const double MostSeconds = 2; // of CPU time for one file
        private const int MostLetters = 500; // of an error

        [Test]
        public void UnsoundPacksAreRefusedAndNamed()
        {
            foreach (Json said in Cases.Read("hostile", "hostile.json").List(50))
            {
                string what = said.At("what").Text();
                AvatarError error = Refusal(Cases.Bytes("hostile", said.At("file").Text()), what);
                Assert.AreEqual("a.avatar", error.Owner, what);
                Json field = said.At("field");
                if (!field.IsMissing) Assert.AreEqual(field.Value, error.Field, what + ": " + error.Message);
                StringAssert.Contains(said.At("message").Text(), error.Message, what);
            }
        }

        [Test]
        public void SoundPacksAreTaken()
        {
            foreach (Json said in Cases.Read("hostile", "sound.json").List(2))
            {
                Assert.IsNotNull(Pack.Read(Cases.Bytes("hostile", said.Text()), "a.avatar"), said.Text());
            }
        }

        [Test]
        public void MutatedPacksAreRefusedOrSound()
        {
            int loaded = 0, refused = 0;
            double most = 0;
            Process process = Process.GetCurrentProcess();
            foreach (byte[] file in Files(Cases.Bytes("mutated.bin")))
            {
                string number = "input " + (loaded + refused);
                process.Refresh();
                TimeSpan before = process.TotalProcessorTime;
                if (IsSound(file, number)) loaded++;
                else refused++;
                process.Refresh();
                double seconds = (process.TotalProcessorTime - before).TotalSeconds;
                Assert.LessOrEqual(seconds, MostSeconds, number);
                most = Math.Max(most, seconds);
            }
            string line = "mutated packs: {0} loaded, {1} refused; the slowest took {2:F2} s of CPU";
            Console.WriteLine(line, loaded, refused, most);
            Assert.Greater(loaded, (loaded + refused) / 100);
            Assert.Greater(refused, (loaded + refused) / 4);
        }

        private static IEnumerable<byte[]> Files(byte[] all)
        {
            for (int at = 0; at < all.Length;)
            {
                byte[] file = new byte[BitConverter.ToInt32(all, at)];
                System.Buffer.BlockCopy(all, at + 4, file, 0, file.Length);
                at += 4 + file.Length;
                yield return file;
            }
        }

        /// <summary>Whether a file loads. Then all that is made of an avatar can be made of it.</summary>
        private static bool IsSound(byte[] file, string what)
        {
            try
            {
                Core.Avatar avatar = Pack.Read(file, "a.avatar");
                foreach (Core.Buffer buffer in avatar.Program.Buffers.Values)
                {
                    if (buffer.Sections.Length > 0) Assert.AreEqual(buffer.Bytes, 4 * buffer.Content().Length, what);
                }
                ProxyMesh.From(avatar);
                new Poser(avatar).Update(new Core.Pose(avatar));
                return true;
            }
            catch (AvatarError error)
            {
                Check(error, what);
                return false;
            }
            catch (Exception error)
            {
                throw new InvalidOperationException(what, error);
            }
        }

        private static AvatarError Refusal(byte[] file, string what)
        {
            try
            {
                Pack.Read(file, "a.avatar");
            }
            catch (AvatarError error)
            {
                Check(error, what);
                return error;
            }
            Assert.Fail(what + " was taken");
            return null;
        }

        private static void Check(AvatarError error, string what)
        {
            Assert.IsFalse(error.Message.Contains("\n"), what);
            Assert.Less(error.Message.Length, MostLetters, what + ": " + error.Message);
        }
    }
}
