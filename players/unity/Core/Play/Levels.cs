using System;

namespace AvatarExport.Core {
    /// <summary>Levels of detail: how tall an avatar stands in an image, and which level serves that height.</summary>
    public static class Levels {
        private const double Margin = 1.1; // of a border between two levels: an avatar that stands at it does not flicker

        /// <summary>
        /// The physical pixels that a length of "whole.Size[1]" covers, facing the camera, at "whole.Target"; how avatar
        /// and camera are turned does not matter. "place" is [3, 4] or [4, 4]. Infinite where the target is
        /// not before the camera.
        /// </summary>
        public static double HeightPx(FramedPart whole, double[] place, AvatarCamera camera) {
            float[] clip = camera.ClipFromWorld;
            double w = clip[15], rowY = 0;
            for (int i = 0; i < 3; i++) {
                double at = place[4 * i + 3];
                for (int k = 0; k < 3; k++) at += place[4 * i + k] * whole.Target[k];
                w += clip[12 + i] * at;
                rowY += (double)clip[4 + i] * clip[4 + i];
            }
            double scale = Math.Pow(Math.Abs(Affine.Determinant(place, 0)), 1 / 3.0);
            double height = Math.Sqrt(rowY) * scale * whole.Size[1] * camera.Height / 2 / w;
            return w > 0 && height <= double.MaxValue ? height : double.PositiveInfinity;
        }

        /// <summary>The coarsest level that serves a height: level i from 1 on serves heights up to its HeightPx.</summary>
        public static int For(LevelInfo[] levels, double heightPx) {
            int best = 0;
            for (int i = 1; i < levels.Length; i++) {
                if (heightPx <= levels[i].HeightPx) best = i; // a level without a height compares false
            }
            return best;
        }

        /// <summary>The level to show after "level": it stays where the height is within a tenth of its borders.</summary>
        public static int Next(LevelInfo[] levels, double heightPx, int level) {
            bool stays = For(levels, heightPx * Margin) <= level && level <= For(levels, heightPx / Margin);
            return stays ? level : For(levels, heightPx);
        }
    }
}
