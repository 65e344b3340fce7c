using System;
using System.Collections.Generic;
using AvatarExport.Core;
using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport {
    /// <summary>
    /// All avatars that are enabled. For each camera it sorts together the splats of those that the camera sees, and
    /// draws them once. Several cameras and both eyes share one deformation a frame.
    /// </summary>
    internal sealed class AvatarScene {
        private const int MostSorts = 16; // sets of avatars that are kept

        /// <summary>The one of this process.</summary>
        public static readonly AvatarScene Shared = new AvatarScene();

        private readonly List<GaussianAvatar> avatars = new List<GaussianAvatar>();
        private readonly List<Resident> seen = new List<Resident>();
        private readonly List<SortedScene> sorts = new List<SortedScene>(); // all of them are bound to buffers
        private readonly SceneBuffers buffers = new SceneBuffers();
        private readonly CameraMatrices matrices = new CameraMatrices();
        private readonly AvatarCamera camera = new AvatarCamera();
        private readonly Plane[] planes = new Plane[6];
        private readonly Plane[] rightPlanes = new Plane[6]; // of the right eye
        private SplatDraw draw;
        private bool toldOrthographic;

        private AvatarScene() {
        }

        public void Add(GaussianAvatar avatar) {
            if (avatars.Contains(avatar)) return;
            avatars.Add(avatar);
            if (avatars.Count == 1) BuiltInHost.Start();
        }

        /// <summary>Takes an avatar out, and frees all that the scene holds on the GPU with the last one.</summary>
        public void Remove(GaussianAvatar avatar) {
            if (!avatars.Remove(avatar)) return;
            Forget();
            if (avatars.Count > 0) return;
            BuiltInHost.Stop();
            buffers.Dispose();
            if (draw != null) draw.Dispose();
            draw = null;
        }

        /// <summary>Call it before a resident is disposed of.</summary>
        public void Forget() {
            sorts.Clear();
            seen.Clear();
        }

        /// <summary>Whether a camera sees an avatar, so that its host has something to draw.</summary>
        public bool Sees(Camera camera) {
            seen.Clear();
            if (avatars.Count == 0) return false;
            if (camera.orthographic) {
                TellOrthographic(camera);
                return false;
            }
            bool stereo = SetPlanes(camera);
            for (int i = 0; i < avatars.Count; i++) {
                GaussianAvatar one = avatars[i];
                if (!one.IsSeenBy(camera, planes) && !(stereo && one.IsSeenBy(camera, rightPlanes))) continue;
                Resident resident = one.ResidentForCamera();
                if (resident != null) seen.Add(resident);
            }
            return seen.Count > 0;
        }

        /// <summary>
        /// Writes the planes of a camera, or of both eyes and returns true: each eye sees more to its side.
        /// </summary>
        private bool SetPlanes(Camera camera) {
            Matrix4x4 clip = camera.stereoEnabled ? ClipOf(camera, Camera.StereoscopicEye.Left) : camera.cullingMatrix;
            GeometryUtility.CalculateFrustumPlanes(clip, planes);
            if (!camera.stereoEnabled) return false;
            GeometryUtility.CalculateFrustumPlanes(ClipOf(camera, Camera.StereoscopicEye.Right), rightPlanes);
            return true;
        }

        private static Matrix4x4 ClipOf(Camera camera, Camera.StereoscopicEye eye) {
            return camera.GetStereoProjectionMatrix(eye) * camera.GetStereoViewMatrix(eye);
        }

        /// <summary>
        /// Records the picture of a camera: deform what has a new pose, then for each eye project, sort, draw.
        /// </summary>
        public void Record(CommandBuffer commands, AvatarView view) {
            if (view.Width < 1 || view.Height < 1 || !Sees(view.Camera)) return;
            SortedScene sorted = SortOf();
            if (sorted == null) return;
            commands.BeginSample("Gaussian avatars");
            // Unity multiplies instances while it draws both eyes at once; each eye is drawn by itself here.
            bool instanced = view.Eyes > 1 && !SystemInfo.supportsMultiview;
            if (instanced) commands.SetInstanceMultiplier(1);
            for (int i = 0; i < seen.Count; i++) seen[i].RecordPose(commands);
            for (int eye = 0; eye < view.Eyes; eye++) RecordEye(commands, view, eye, sorted);
            if (instanced) commands.SetInstanceMultiplier(2);
            commands.EndSample("Gaussian avatars");
        }

        private void RecordEye(CommandBuffer commands, AvatarView view, int eye, SortedScene sorted) {
            if (!CameraMatrices.HasPerspective(view.Projection[eye])) return;
            bool reversed = SystemInfo.usesReversedZBuffer;
            matrices.Write(view.View[eye], view.Projection[eye], reversed, view.Width, view.Height, camera);
            for (int i = 0; i < seen.Count; i++) {
                seen[i].See(camera);
                seen[i].RecordView(commands);
            }
            sorted.Record(commands);
            draw.Record(commands, view, eye, buffers.Quads, sorted.Count);
        }

        /// <summary>
        /// The sort of what is seen; or null, told once, where it exceeds a limit or a shader does not run.
        /// </summary>
        private SortedScene SortOf() {
            for (int i = 0; i < sorts.Count; i++) {
                if (sorts[i].Holds(seen)) return sorts[i];
            }
            try {
                if (draw == null) draw = new SplatDraw();
                var made = new SortedScene(seen);
                if (buffers.Reserve(made.Buffers) || sorts.Count >= MostSorts) sorts.Clear();
                made.Bind(buffers);
                sorts.Add(made);
                return made;
            } catch (AvatarError error) {
                sorts.Clear();
                Warnings.Once(error.Message);
                return null;
            }
        }

        private void TellOrthographic(Camera camera) {
            if (toldOrthographic || camera.cameraType != CameraType.Game) return;
            toldOrthographic = true;
            Warnings.Once(camera.name
                + ": this camera is orthographic and shows no avatar; set Projection to Perspective");
        }
    }

    /// <summary>Warnings that are written once, not each frame.</summary>
    internal static class Warnings {
        private static readonly HashSet<string> Told = new HashSet<string>();

        /// <summary>Writes a warning to the console, if it was not written before.</summary>
        public static void Once(string text, UnityEngine.Object about = null) {
            if (Told.Add(text)) Debug.LogWarning("Gaussian avatars: " + text, about);
        }
    }
}
