using UnityEngine;
using UnityEngine.Rendering;
using UnityEngine.Rendering.HighDefinition;

namespace AvatarExport.HighDefinition {
    /// <summary>
    /// The avatars of a camera, before post-processing. The camera's image is exposed already at this point, and splats
    /// are written as they are: exposure does not change them, as it does not change an unlit material. Tone mapping
    /// does.
    /// </summary>
    internal sealed class AvatarCustomPass : CustomPass {
        private readonly AvatarView view = new AvatarView();

        protected override void Execute(CustomPassContext ctx) {
            HDCamera seen = ctx.hdCamera;
            bool both = seen.camera.stereoEnabled && ctx.cameraColorBuffer.rt.volumeDepth > 1;
            if (both) view.SetStereo(seen.camera);
            else view.SetMono(seen.camera);
            view.Fill(ctx.cameraColorBuffer.nameID, seen.actualWidth, seen.actualHeight);
            view.TopRowFirst = 0;
            view.HasDepth = true;
            view.IsArray = TextureXR.useTexArray;
            AvatarScene.Shared.Record(ctx.cmd, view);
        }
    }
}
