using System;
using System.Collections.Generic;
using System.Linq;
using System.Net;
using System.Net.Sockets;
using System.Text;
using System.Threading.Tasks;
using AvatarExport.Core;
using NUnit.Framework;
using UnityEngine;
using UnityEngine.Networking;

namespace AvatarExport.Tests {
    /// <summary>Files and faces from outside.</summary>
    public sealed class InputTests : Stage {
        private const int Wait = 200; // tries of 10 ms

        [TestCase("https://host/a.avatar", "https://host/a.avatar")]
        [TestCase("heads/a b.avatar", "file:///streaming/heads/a%20b.avatar")]
        public void AFileIsLoadedFromAnAddressOrFromStreamingAssets(string asked, string address) {
            GaussianAvatar avatar = Add(null);
            UnityWebRequest.answer = Packs.Bytes(Packs.Joints);
            Assert.AreEqual(TaskStatus.RanToCompletion, avatar.LoadAsync(asked).Status);
            Assert.AreEqual(address, UnityWebRequest.asked);
            Assert.IsNotNull(avatar.Avatar);
        }

        [TestCase("https://host/none.avatar", "404 Not Found")]
        [TestCase("http://host/none.avatar", "Insecure connection not allowed")] // an exception of Unity
        public void WhatTheServerOrUnitySaysIsInTheError(string asked, string wanted) {
            GaussianAvatar avatar = Add(Packs.Joints);
            LoadedAvatar shown = avatar.Avatar;
            UnityWebRequest.answer = null;
            var error = (AvatarError)avatar.LoadAsync(asked).Exception.InnerException;
            StringAssert.Contains("none.avatar: cannot be loaded: " + wanted, error.Message);
            Assert.AreSame(shown, avatar.Avatar);
        }

        [Test]
        public void LiveLinkFaceIsHeardOverUdpWithoutAllocation() {
            LiveLinkFace face = new GameObject("face").AddComponent<LiveLinkFace>();
            face.Port = FreePort();
            var frame = new DrivingFrame();
            Assert.IsFalse(face.Read(frame), "nothing was sent");
            byte[] packet = Packet(0.75f);
            using (var sender = new UdpClient()) {
                sender.Send(new byte[] { 6, 1, 2 }, 3, "127.0.0.1", face.Port); // no packet of this protocol
                sender.Send(packet, packet.Length, "127.0.0.1", face.Port);
                bool heard = false;
                for (int i = 0; i < Wait && !heard; i++) {
                    System.Threading.Thread.Sleep(10);
                    heard = face.Read(frame);
                }
                Assert.IsTrue(heard);
            }
            Assert.AreEqual(0.75, frame.Weights[Array.IndexOf(Arkit.Names, "jawOpen")], 0);
            long found = Allocated(() => {
                for (int i = 0; i < 100; i++) face.Read(frame);
            });
            Assert.AreEqual(0L, found);
            face.Send("OnDisable");
            Assert.IsFalse(face.Read(frame), "the socket is closed");
        }

        [Test]
        public void APortThatCannotBeHadIsToldWithWhatToDo() {
            LiveLinkFace face = new GameObject("face").AddComponent<LiveLinkFace>();
            face.Port = 70000;
            StringAssert.Contains("Choose another port", Debug.Told.Find(line => line.Contains("port 70000")));
            Assert.IsFalse(face.Read(new DrivingFrame()));
            face.Send("OnDisable");
        }

        [Test]
        public void IdleLifeIsAFaceAtEveryMoment() {
            IdleLife life = new GameObject("face").AddComponent<IdleLife>();
            life.Seed = -5;
            DrivingFrame frame = new DrivingFrame(), want = new DrivingFrame();
            for (int i = 0; i < 50; i++) Assert.IsTrue(life.Read(frame));
            Idle.Write(50 * (double)Time.deltaTime, unchecked((uint)-5), want);
            Assert.AreEqual(want.Weights[0], frame.Weights[0], 1e-6);
            Assert.AreEqual(want.LeftEye[0], frame.LeftEye[0], 1e-9);
        }

        private static int FreePort() {
            using (var one = new UdpClient(new IPEndPoint(IPAddress.Any, 0))) return ((IPEndPoint)one.Client.LocalEndPoint).Port;
        }

        /// <summary>Version 6, with every channel 0 but jawOpen.</summary>
        private static byte[] Packet(float jawOpen) {
            var made = new List<byte> { 6 };
            Action<byte[]> add = little => made.AddRange(little.Reverse());
            foreach (string text in new[] { "device", "subject" }) {
                add(BitConverter.GetBytes(text.Length));
                made.AddRange(Encoding.UTF8.GetBytes(text));
            }
            foreach (int number in new[] { 1, 0, 60, 1 }) add(BitConverter.GetBytes(number));
            made.Add((byte)Arkit.Channels.Length);
            foreach (string channel in Arkit.Channels) add(BitConverter.GetBytes(channel == "jawOpen" ? jawOpen : 0f));
            return made.ToArray();
        }
    }
}
