using System;
using System.Collections.Generic;
using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport.Tests
{
    /// <summary>An avatar in a scene of stubs, a camera, and what a frame records.</summary>
    internal sealed class Stage
    {
        public const int Width = 320, Height = 240;

        private static readonly List<GaussianAvatar> Left = new List<GaussianAvatar>();

        public readonly Camera Camera;
        public readonly List<GaussianAvatar> Avatars = new List<GaussianAvatar>();

        public Stage()
        {
            // A test that failed leaves its avatars.
            foreach (GaussianAvatar one in Left.ToArray()) UnityEngine.Object.Destroy(one.gameObject);
            Left.Clear();
            Debug.Told.Clear();
            SystemInfo.compute = SystemInfo.reversed = SystemInfo.top = true;
            SystemInfo.multiview = false;
            SystemInfo.vertexBuffers = 8;
            Camera = NewCamera();
        }

        public static Camera NewCamera()
        {
            Camera camera = new GameObject("camera").AddComponent<Camera>();
            Matrix4x4 view = Matrix4x4.identity,
                projection = new Matrix4x4 { m00 = 1.5f, m11 = 2, m22 = -1.02f, m23 = -0.2f, m32 = -1 };
            view.m22 = -1;
            view.m23 = -2;
            camera.cullingMask = ~0;
            camera.cameraType = CameraType.Game;
            camera.worldToCameraMatrix = view;
            camera.projectionMatrix = projection;
            camera.nearClipPlane = 0.1f;
            camera.pixelRect = new Rect(0, 0, Width, Height);
            return camera;
        }

        public GaussianAvatar Add(string pack)
        {
            GaussianAvatar avatar = new GameObject(pack).AddComponent<GaussianAvatar>();
            avatar.Load(Packs.Bytes(pack), pack);
            Avatars.Add(avatar);
            Left.Add(avatar);
            return avatar;
        }

        /// <summary>
        /// What Unity does for a frame of one camera: scripts, then the camera. Returns what it recorded.
        /// </summary>
        public CommandBuffer Frame()
        {
            foreach (GaussianAvatar one in Avatars) one.Send("LateUpdate");
            return Render(Camera);
        }

        /// <summary>One camera of the Built-in pipeline; null if it was given no commands.</summary>
        public static CommandBuffer Render(Camera camera)
        {
            Camera.onPreCull?.Invoke(camera);
            Camera.onPreRender?.Invoke(camera);
            CommandBuffer found = camera.added.Count > 0 ? camera.added[0] : null;
            Camera.onPostRender?.Invoke(camera);
            return found;
        }

        public void End()
        {
            foreach (GaussianAvatar one in Avatars) UnityEngine.Object.Destroy(one.gameObject);
            Left.RemoveAll(Avatars.Contains);
        }

        /// <summary>Entries of what was dispatched, in order.</summary>
        public static List<string> Entries(CommandBuffer commands)
        {
            var found = new List<string>();
            for (int i = 0; i < commands.used; i++)
            {
                if (commands.pool[i].What == "DispatchCompute") found.Add(commands.pool[i].Shader.name);
            }
            return found;
        }

        /// <summary>All commands of a kind.</summary>
        public static List<Command> All(CommandBuffer commands, string what)
        {
            return commands.pool.GetRange(0, commands.used).FindAll(one => one.What == what);
        }
    }
}
