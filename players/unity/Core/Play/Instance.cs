using System;

namespace AvatarExport.Core
{
    /// <summary>
    /// One avatar in a scene: its pose, its place, and the values of the frame that its passes ask for. Several may
    /// share an avatar. Updates allocate nothing.
    /// </summary>
    public sealed class Instance
    {
        /// <summary>What is shown.</summary>
        public readonly Avatar Avatar;

        /// <summary>Set it before UpdatePose.</summary>
        public readonly Pose Pose;

        /// <summary>Scene from avatar: row-major 4x4, any affine matrix. The pose's own movement comes first.</summary>
        public readonly double[] World = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };

        /// <summary>For PassList.Set.</summary>
        public readonly FrameValues Values;

        /// <summary>The content of buffer Pose; empty if there is none.</summary>
        public readonly float[] PoseFloats;

        private readonly Poser poser;
        private int level;

        /// <summary>An instance at rest. Throws AvatarError if there is no such level, 0 the finest.</summary>
        public Instance(Avatar avatar, int level)
        {
            Avatar = avatar;
            Level = level;
            Pose = new Pose(avatar);
            poser = new Poser(avatar);
            Values = new FrameValues(avatar.Groups.Length);
            PoseFloats = poser.Update(Pose).PoseFloats;
            UpdatePose();
        }

        /// <summary>Level of detail, 0 the finest. Setting it throws AvatarError if there is no such level.</summary>
        public int Level
        {
            get { return level; }
            set
            {
                int levels = Avatar.Program.Levels.Length;
                if (value < 0 || value >= levels)
                {
                    throw new AvatarError($"there is no level {value}; it has {levels}, counted from 0", Avatar.Name, "level");
                }
                level = value;
            }
        }

        /// <summary>The passes and chunks of the level.</summary>
        public Level Program
        {
            get { return Avatar.Program.Levels[level]; }
        }

        /// <summary>
        /// The coarsest level of an avatar that is meant for an image of it that is so many pixels high.
        /// </summary>
        public static int LevelFor(Avatar avatar, double heightPx)
        {
            int best = 0;
            for (int i = 1; i < avatar.Levels.Length; i++)
            {
                if (heightPx <= avatar.Levels[i].HeightPx) best = i; // a level without a height compares false
            }
            return best;
        }

        /// <summary>Stage joints and the camera.</summary>
        public void Update(Camera camera)
        {
            UpdatePose();
            UpdateCamera(camera);
        }

        /// <summary>Stage joints: PoseFloats and the values of the pose.</summary>
        public void UpdatePose()
        {
            Values.SetPosed(poser.Update(Pose));
        }

        /// <summary>The values of a camera: again for each camera that sees the same pose.</summary>
        public void UpdateCamera(Camera camera)
        {
            Values.SetCamera(camera, World);
        }
    }
}
