using System;
using System.Collections.Generic;
using NUnit.Framework;
using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport.Tests {
    /// <summary>Avatars in a scene of stubs, a camera, and what a frame records.</summary>
    public abstract class Stage {
        internal const int Width = 320, Height = 240;

        private static readonly List<GaussianAvatar> Avatars = new List<GaussianAvatar>();

        internal Camera Seen; // by which Frame renders

        [SetUp]
        public void Begin() {
            End();
            Debug.Told.Clear();
            SystemInfo.compute = SystemInfo.reversed = SystemInfo.top = Application.playing = Shader.found = ComputeShader.runs = true;
            SystemInfo.multiview = GeometryUtility.onlyLast = false;
            GeometryUtility.seen = true;
            SystemInfo.vertexBuffers = 8;
            SystemInfo.most = 1L << 31;
            Seen = NewCamera();
        }

        internal static void End() {
            foreach (GaussianAvatar one in Avatars) UnityEngine.Object.Destroy(one.gameObject);
            Avatars.Clear();
        }

        internal static Camera NewCamera() {
            Camera camera = new GameObject("camera").AddComponent<Camera>();
            Matrix4x4 view = Matrix4x4.identity;
            view.m22 = -1;
            view.m23 = -2;
            camera.cullingMask = ~0;
            camera.cameraType = CameraType.Game;
            camera.worldToCameraMatrix = view;
            camera.projectionMatrix = new Matrix4x4 { m00 = 1.5f, m11 = 2, m22 = -1.02f, m23 = -0.2f, m32 = -1 };
            camera.pixelRect = new Rect(0, 0, Width, Height);
            return camera;
        }

        /// <summary>An object with the component, which shows a pack; nothing for null.</summary>
        internal static GaussianAvatar Add(string pack, GameObject owner = null) {
            GaussianAvatar avatar = (owner ?? new GameObject("avatar")).AddComponent<GaussianAvatar>();
            if (pack != null) avatar.Load(Packs.Bytes(pack), pack);
            Avatars.Add(avatar);
            return avatar;
        }

        internal static GaussianAvatarAsset Asset(byte[] bytes) => new GaussianAvatarAsset { name = "asset", Bytes = bytes };

        /// <summary>What Unity does for a frame of one camera: scripts, then the camera. Returns what it recorded.</summary>
        internal CommandBuffer Frame() {
            foreach (GaussianAvatar one in Avatars) one.Send("LateUpdate");
            return Render(Seen);
        }

        /// <summary>One camera of the Built-in pipeline; null if it was given no commands.</summary>
        internal static CommandBuffer Render(Camera camera) {
            Camera.onPreCull?.Invoke(camera);
            Camera.onPreRender?.Invoke(camera);
            CommandBuffer found = camera.added.Count > 0 ? camera.added[0] : null;
            Camera.onPostRender?.Invoke(camera);
            return found;
        }

        internal static void Remove(GaussianAvatar avatar) {
            avatar.Send("OnDisable");
            Avatars.Remove(avatar);
        }

        /// <summary>Draws nothing three times, and says why once.</summary>
        internal void SaysOnce(string why) {
            for (int i = 0; i < 3; i++) Assert.IsNull(Frame());
            Assert.AreEqual(1, Debug.Told.Count);
            StringAssert.Contains(why, Debug.Told[0]);
        }

        /// <summary>Entries of what was dispatched, in order.</summary>
        internal static List<string> Entries(CommandBuffer commands) {
            return All(commands, "DispatchCompute").ConvertAll(one => one.Shader.name);
        }

        /// <summary>All commands of a kind.</summary>
        internal static List<Command> All(CommandBuffer commands, string what) {
            return commands.pool.GetRange(0, commands.used).FindAll(one => one.What == what);
        }

        /// <summary>Bytes that an action allocates.</summary>
        internal static long Allocated(Action action) {
            var told = (Func<long>)Delegate.CreateDelegate(typeof(Func<long>), typeof(GC), "GetAllocatedBytesForCurrentThread");
            action();
            told();
            long before = told();
            action();
            return told() - before;
        }
    }
}
