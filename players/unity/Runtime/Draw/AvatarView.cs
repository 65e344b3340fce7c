using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport {
    /// <summary>What one camera draws into: filled by the host of a render pipeline, again for each picture.</summary>
    internal sealed class AvatarView {
        /// <summary>TopRowFirst: the Built-in pipeline says in a shader constant which row comes first.</summary>
        public const int AskShader = -1;

        public Camera Camera;

        /// <summary>1, or 2 for both eyes in one pass: eye i is slice i of Target and of the depth texture.</summary>
        public int Eyes;

        /// <summary>Camera from world of each eye, as Camera.worldToCameraMatrix.</summary>
        public readonly Matrix4x4[] View = new Matrix4x4[2];

        /// <summary>Of each eye, as Camera.projectionMatrix: depth -1..1, y up.</summary>
        public readonly Matrix4x4[] Projection = new Matrix4x4[2];

        /// <summary>Pixels that the camera draws.</summary>
        public int Width;

        /// <summary>Pixels that the camera draws.</summary>
        public int Height;

        public RenderTargetIdentifier Target;

        /// <summary>The part of the target that is drawn, pixels.</summary>
        public Rect Viewport;

        /// <summary>Rows of the whole target.</summary>
        public int TargetRows;

        /// <summary>1: row 0 of the target is its top row; 0: its bottom row; or AskShader.</summary>
        public int TopRowFirst;

        /// <summary>Whether _CameraDepthTexture holds the depth of this camera.</summary>
        public bool HasDepth;

        /// <summary>Whether target and depth texture are arrays, with a slice for each eye.</summary>
        public bool IsArray;

        /// <summary>Takes the matrices of a camera without stereo, or those of one eye.</summary>
        public void SetMono(Camera camera) {
            Camera = camera;
            Eyes = 1;
            View[0] = camera.worldToCameraMatrix;
            Projection[0] = camera.projectionMatrix;
        }

        /// <summary>Takes the matrices of both eyes.</summary>
        public void SetStereo(Camera camera) {
            Camera = camera;
            Eyes = 2;
            SetEye(0, Camera.StereoscopicEye.Left);
            SetEye(1, Camera.StereoscopicEye.Right);
        }

        /// <summary>Takes the matrices of one eye as those of eye "index".</summary>
        public void SetEye(int index, Camera.StereoscopicEye eye) {
            View[index] = Camera.GetStereoViewMatrix(eye);
            Projection[index] = Camera.GetStereoProjectionMatrix(eye);
        }

        /// <summary>Says that the picture fills a target of "width" x "height" pixels.</summary>
        public void Fill(RenderTargetIdentifier target, int width, int height) {
            Target = target;
            Width = width;
            Height = height;
            TargetRows = height;
            Viewport = new Rect(0, 0, width, height);
        }
    }
}
