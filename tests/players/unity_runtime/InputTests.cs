using System;
using System.Collections.Generic;
using System.Net;
using System.Net.Sockets;
using System.Text;
using System.Threading.Tasks;
using NUnit.Framework;
using UnityEngine;
using UnityEngine.Networking;

namespace AvatarExport.Tests
{
    /// <summary>Files and faces from outside.</summary>
    public sealed class InputTests
    {
        private const int Wait = 200; // tries of 10 ms

        [TestCase("https://host/a.avatar", "https://host/a.avatar")]
        [TestCase("heads/a b.avatar", "file:///streaming/heads/a%20b.avatar")]
        public void AFileIsLoadedFromAnAddressOrFromStreamingAssets(string asked, string address)
        {
            var stage = new Stage();
            GaussianAvatar avatar = new GameObject("avatar").AddComponent<GaussianAvatar>();
            stage.Avatars.Add(avatar);
            UnityWebRequest.answer = Packs.Bytes(Packs.Joints);
            Task task = avatar.LoadAsync(asked);
            Assert.AreEqual(TaskStatus.RanToCompletion, task.Status);
            Assert.AreEqual(address, UnityWebRequest.asked);
            Assert.IsNotNull(avatar.Avatar);
            stage.End();
        }

        [TestCase("https://host/none.avatar", "404 Not Found")]
        [TestCase("http://host/none.avatar", "Insecure connection not allowed")] // an exception of Unity
        public void WhatTheServerOrUnitySaysIsInTheError(string asked, string wanted)
        {
            var stage = new Stage();
            GaussianAvatar avatar = stage.Add(Packs.Joints);
            Core.Avatar shown = avatar.Avatar;
            UnityWebRequest.answer = null;
            Task task = avatar.LoadAsync(asked);
            string said = task.Exception.InnerException.Message;
            Assert.IsTrue(task.Exception.InnerException is Core.AvatarError);
            StringAssert.Contains(wanted, said);
            StringAssert.Contains("none.avatar", said);
            Assert.AreSame(shown, avatar.Avatar);
            stage.End();
        }

        [Test]
        public void LiveLinkFaceIsHeardOverUdpWithoutAllocation()
        {
            LiveLinkFace face = new GameObject("face").AddComponent<LiveLinkFace>();
            face.Port = FreePort();
            var frame = new Core.DrivingFrame();
            Assert.IsFalse(face.Read(frame), "nothing was sent");
            byte[] packet = Packet(0.75f);
            using (var sender = new UdpClient())
            {
                sender.Send(new byte[] { 6, 1, 2 }, 3, "127.0.0.1", face.Port); // no packet of this protocol
                sender.Send(packet, packet.Length, "127.0.0.1", face.Port);
                bool heard = false;
                for (int i = 0; i < Wait && !heard; i++)
                {
                    System.Threading.Thread.Sleep(10);
                    heard = face.Read(frame);
                }
                Assert.IsTrue(heard);
            }
            Assert.AreEqual(0.75, frame.Weights[Array.IndexOf(Core.Arkit.Names, "jawOpen")], 0);
            var allocated =
                (Func<long>)Delegate.CreateDelegate(typeof(Func<long>), typeof(GC),
                "GetAllocatedBytesForCurrentThread");
            allocated();
            long before = allocated();
            for (int i = 0; i < 100; i++) face.Read(frame);
            long found = allocated() - before;
            Assert.AreEqual(0L, found);
            face.Send("OnDisable");
            Assert.IsFalse(face.Read(frame), "the socket is closed");
        }

        [Test]
        public void APortThatCannotBeHadIsToldWithWhatToDo()
        {
            Debug.Told.Clear();
            LiveLinkFace face = new GameObject("face").AddComponent<LiveLinkFace>();
            face.Port = 70000;
            List<string> told = Debug.Told.FindAll(line => line.Contains("port 70000"));
            Assert.AreEqual(1, told.Count);
            StringAssert.Contains("Choose another port", told[0]);
            Assert.IsFalse(face.Read(new Core.DrivingFrame()));
            face.Send("OnDisable");
        }

        private static int FreePort()
        {
            using (var one =
                new UdpClient(new IPEndPoint(IPAddress.Any, 0))) return ((IPEndPoint)one.Client.LocalEndPoint).Port;
        }

        /// <summary>Version 6, with every channel 0 but jawOpen.</summary>
        private static byte[] Packet(float jawOpen)
        {
            var made = new List<byte> { 6 };
            foreach (string text in new[] { "device", "subject" })
            {
                Add(made, BitConverter.GetBytes(text.Length));
                made.AddRange(Encoding.UTF8.GetBytes(text));
            }
            foreach (int number in new[] { 1, 0, 60, 1 }) Add(made, BitConverter.GetBytes(number));
            made.Add((byte)Core.Arkit.Channels.Length);
            foreach (string channel in Core.Arkit.Channels)
            {
                Add(made, BitConverter.GetBytes(channel == "jawOpen" ? jawOpen : 0));
            }
            return made.ToArray();
        }

        private static void Add(List<byte> made, byte[] little)
        {
            Array.Reverse(little);
            made.AddRange(little);
        }
    }
}
