using System;

namespace AvatarExport.Core {
    /// <summary>
    /// One avatar in a scene: its pose, its place, and the values of the frame that its passes ask for. Several may
    /// share an avatar. Updates allocate nothing.
    /// </summary>
    public sealed class Instance {
        /// <summary>What is shown.</summary>
        public readonly LoadedAvatar Avatar;

        /// <summary>Set it before UpdatePose.</summary>
        public readonly AvatarPose Pose;

        /// <summary>
        /// Scene from the person: row-major 4x4, any affine matrix. The person's frame is right-handed for every pack:
        /// +Y up, the face looks along +Z, +X is the person's left. The pose's own movement comes first.
        /// </summary>
        public readonly double[] Place = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };

        /// <summary>For PassList.Set.</summary>
        public readonly FrameValues Values;

        /// <summary>The content of buffer Pose; empty if there is none.</summary>
        public readonly float[] PoseFloats;

        private readonly LightRows rows = new LightRows();
        private SceneLight light;
        private readonly double[] placed = new double[16]; // scene from the pack's frame
        private readonly double[] posed = new double[12]; // scene from the person at rest
        private readonly Poser poser;
        private int level;

        /// <summary>An instance at rest. Throws AvatarError if there is no such level, 0 the finest.</summary>
        public Instance(LoadedAvatar avatar, int level) {
            Avatar = avatar;
            Level = level;
            Pose = new AvatarPose(avatar);
            poser = new Poser(avatar);
            Values = new FrameValues(avatar.Groups.Length);
            PoseFloats = poser.Update(Pose).PoseFloats;
            UpdatePose();
        }

        /// <summary>Level of detail, 0 the finest. Setting it throws AvatarError if there is no such level.</summary>
        public int Level {
            get => level;
            set {
                int levels = Avatar.Program.Levels.Length;
                if (value < 0 || value >= levels) {
                    throw new AvatarError($"there is no level {value}; the last one is level {levels - 1}", Avatar.Name, "level");
                }
                level = value;
            }
        }

        /// <summary>
        /// The light of the scene; null: the avatar is shown as trained. Updates take it as it is then. Setting it throws
        /// AvatarError for an avatar that takes none.
        /// </summary>
        public SceneLight Light {
            get => light;
            set {
                if (value != null && Avatar.Relight == null) {
                    throw new AvatarError("its colours hold an unknown light; make it with `pack --relight`", Avatar.Name, "light");
                }
                light = value;
                CastsShadow = false; // until an update
            }
        }

        /// <summary>Whether the passes of Level.Shadow are to run, after an update.</summary>
        public bool CastsShadow { get; private set; }

        /// <summary>The passes and chunks of the level.</summary>
        public Level Program => Avatar.Program.Levels[level];

        /// <summary>Stage joints and the camera.</summary>
        public void Update(AvatarCamera camera) {
            UpdatePose();
            UpdateCamera(camera);
        }

        /// <summary>Stage joints: PoseFloats and the values of the pose and of the light.</summary>
        public void UpdatePose() {
            Values.SetPosed(poser.Update(Pose));
            UpdateLight();
        }

        /// <summary>The values of a camera, and of the light: again for each camera that sees the same pose.</summary>
        public void UpdateCamera(AvatarCamera camera) {
            SetPlaced();
            Values.SetCamera(camera, placed);
            UpdateLight();
        }

        /// <summary>Throws AvatarError for a light whose numbers cannot be used.</summary>
        private void UpdateLight() {
            if (light == null) return;
            SetPlaced();
            int skin = Avatar.Relight.Head < 0 ? -1 : Avatar.Program.Pose.Joints + 12 * Avatar.Relight.Head;
            string wrong = rows.Write(light, Avatar.Relight, placed, Pose.WorldFromAvatar, PoseFloats, skin);
            if (wrong != null) throw new AvatarError(wrong, Avatar.Name, "light");
            Values.SetLight(rows);
            CastsShadow = rows.CastsShadow;
        }

        /// <summary>
        /// How tall the avatar stands in the image of a camera, as it is placed and posed now: the physical pixels that
        /// Framing.Whole.Size[1] covers, facing the camera. Infinite where it is not before the camera.
        /// </summary>
        public double HeightPx(AvatarCamera camera) {
            SetPlaced();
            Affine.Multiply(posed, 0, placed, 0, Pose.WorldFromAvatar, 0);
            for (int at = 0; at < 12 && Avatar.Handedness == "left"; at += 4) posed[at] = -posed[at];
            return Levels.HeightPx(Avatar.Framing.Whole, posed, camera);
        }

        /// <summary>
        /// The one place where a left-handed pack is mirrored: x of its frame points the other way than the person's.
        /// </summary>
        private void SetPlaced() {
            Array.Copy(Place, placed, 16);
            for (int at = 0; at < 16 && Avatar.Handedness == "left"; at += 4) placed[at] = -placed[at];
        }
    }
}
