using UnityEngine;
using UnityEngine.Rendering;
#if AVATAR_VR
using UnityEngine.XR;
#endif

namespace AvatarExport {
    /// <summary>
    /// Draws avatars in the Built-in render pipeline: after the transparent objects, before image effects. Render
    /// pipelines of scripts do not call these events.
    /// </summary>
    internal static class BuiltInHost {
        private const CameraEvent When = CameraEvent.AfterForwardAlpha;

        private static readonly AvatarView View = new AvatarView();
        private static readonly RenderTargetIdentifier Target =
            new RenderTargetIdentifier(BuiltinRenderTextureType.CameraTarget);
        private static CommandBuffer commands;
        private static Camera added; // the camera that has the commands now

        /// <summary>Begins to listen to cameras.</summary>
        public static void Start() {
            Stop();
            commands = new CommandBuffer { name = "Gaussian avatars" };
            Camera.onPreCull += BeforeCull;
            Camera.onPreRender += BeforeRender;
            Camera.onPostRender += AfterRender;
        }

        public static void Stop() {
            Camera.onPreCull -= BeforeCull;
            Camera.onPreRender -= BeforeRender;
            Camera.onPostRender -= AfterRender;
            Detach();
            if (commands != null) commands.Release();
            commands = null;
        }

        /// <summary>Depth is compared in the shader: the camera has to write it.</summary>
        private static void BeforeCull(Camera camera) {
            if ((camera.depthTextureMode & DepthTextureMode.Depth) == 0 && AvatarScene.Shared.Sees(camera)) {
                camera.depthTextureMode |= DepthTextureMode.Depth;
            }
        }

        private static void BeforeRender(Camera camera) {
            Detach();
            if (!AvatarScene.Shared.Sees(camera)) return;
            commands.Clear();
            Fill(camera);
            AvatarScene.Shared.Record(commands, View);
            camera.AddCommandBuffer(When, commands);
            added = camera;
        }

        private static void AfterRender(Camera camera) {
            if (camera == added) Detach();
        }

        private static void Detach() {
            if (added != null) added.RemoveCommandBuffer(When, commands);
            added = null;
        }

        private static void Fill(Camera camera) {
            View.SetMono(camera);
            Rect rect = camera.pixelRect;
            int width = camera.scaledPixelWidth, height = camera.scaledPixelHeight;
            float scaleX = width / rect.width, scaleY = height / rect.height;
            RenderTexture texture = camera.targetTexture;
            View.Fill(Target, width, height);
            // With HDR or image effects a camera draws into an image of its own, as large as its part of the screen.
            RenderTexture drawn = camera.activeTexture;
            bool own = drawn != null && drawn != texture && drawn.width == width && drawn.height == height;
            if (!own) View.Viewport = new Rect(rect.x * scaleX, rect.y * scaleY, width, height);
            View.TargetRows = Mathf.RoundToInt((texture != null ? texture.height : Screen.height) * scaleY);
            View.TopRowFirst = AvatarView.AskShader;
            View.HasDepth = true;
            View.IsArray = false;
            FillStereo(camera);
        }

        private static void FillStereo(Camera camera) {
#if AVATAR_VR
            if (!camera.stereoEnabled) return;
            XRSettings.StereoRenderingMode mode = XRSettings.stereoRenderingMode;
            bool both = mode == XRSettings.StereoRenderingMode.SinglePassInstanced
                || mode == XRSettings.StereoRenderingMode.SinglePassMultiview;
            View.IsArray = both;
            View.TargetRows = View.Height;
            if (both) View.SetStereo(camera);
            else View.SetEye(0, camera.stereoActiveEye == Camera.MonoOrStereoscopicEye.Right
                ? Camera.StereoscopicEye.Right : Camera.StereoscopicEye.Left);
#endif
        }
    }
}
