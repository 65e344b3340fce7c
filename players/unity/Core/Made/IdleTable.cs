// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.
namespace AvatarExport.Core {
    /// <summary>Numbers of idle life.</summary>
    public static class IdleTable {
        /// <summary>Seconds of a slot with one blink or one pair: 13 a minute.</summary>
        public const double BlinkEveryS = 4.5;

        /// <summary>Part of a slot, from its begin, in which the blink may start: 2 to 7 s apart.</summary>
        public const double BlinkWindow = 0.55;

        /// <summary>Seconds in which the lids fall.</summary>
        public const double BlinkCloseS = 0.09;

        /// <summary>Seconds of closed eyes; longer than a frame of a film at 25 frames a second, which thus shows them closed.</summary>
        public const double BlinkClosedS = 0.045;

        /// <summary>Seconds in which the lids rise, fast at first.</summary>
        public const double BlinkOpenS = 0.18;

        /// <summary>How often a second blink follows at once.</summary>
        public const double BlinkPairChance = 0.12;

        /// <summary>Seconds from the begin of the first to that of the second.</summary>
        public const double BlinkPairS = 0.36;

        /// <summary>a blink starts with the largest gaze shift of its window if that has more degrees.</summary>
        public const double BlinkWithGazeDeg = 3.0;

        /// <summary>Mean seconds of a fixation.</summary>
        public const double FixationEveryS = 1.7;

        /// <summary>Part of that in which the gaze may shift: fixations of 0.4 to 3 s.</summary>
        public const double FixationWindow = 0.75;

        /// <summary>How many fixations are on the viewer.</summary>
        public const double GazeViewerChance = 0.68;

        /// <summary>How far these lie from straight ahead at most, yaw and pitch, degrees: over a face.</summary>
        public static readonly double[] GazeViewerDeg = { 1.1, 0.7 };

        /// <summary>How far the others lie at most; their yaw is at least 0.4 of it. Within 8 degrees.</summary>
        public static readonly double[] GazeAwayDeg = { 6.9, 4.0 };

        /// <summary>Seconds of the least gaze shift.</summary>
        public const double SaccadeS = 0.021;

        /// <summary>And for each degree more.</summary>
        public const double SaccadeSPerDeg = 0.0022;

        /// <summary>The head's part of a gaze shift; the eyes then turn back, so that the gaze rests.</summary>
        public const double HeadShare = 0.3;

        /// <summary>Seconds by which the head starts later than the eyes.</summary>
        public const double HeadDelayS = 0.04;

        /// <summary>Seconds in which it turns, with least jerk.</summary>
        public const double HeadTurnS = 0.95;

        /// <summary>Seconds of a breath: 14 a minute.</summary>
        public const double BreathEveryS = 4.285714285714286;

        /// <summary>Part of a breath that flows in.</summary>
        public const double BreathIn = 0.4;

        /// <summary>Part that flows out; the rest is a pause.</summary>
        public const double BreathOut = 0.48;

        /// <summary>Breaths come this part of a breath early or late at most; knots of that drift, seconds.</summary>
        public static readonly double[] BreathDrift = { 0.3, 9.0 };

        /// <summary>What full lungs add: channels, degrees or weight; the jaw stays, since it parts the lips.</summary>
        public static readonly IdleRow[] Breath = {
            new IdleRow("headPitch", 0, 0.8),
            new IdleRow("noseSneerLeft", 1, 0.06),
            new IdleRow("noseSneerRight", 1, 0.06),
            new IdleRow("mouthShrugLower", 2, 0.04),
            new IdleRow("browInnerUp", 3, 0.02),
        };

        /// <summary>Channels on random curves: seconds between knots; size in degrees to both sides, or half the greatest weight.</summary>
        public static readonly IdleRow[] Wander = {
            new IdleRow("headYaw", 0, 5.3, 2.2),
            new IdleRow("headYaw", 1, 1.6, 0.5),
            new IdleRow("headPitch", 2, 4.7, 1.3),
            new IdleRow("headPitch", 3, 1.4, 0.4),
            new IdleRow("headRoll", 4, 4.1, 1.9),
            new IdleRow("headRoll", 5, 1.9, 0.4),
            new IdleRow("mouthSmileLeft", 6, 4.3, 0.06),
            new IdleRow("mouthSmileRight", 6, 4.3, 0.06),
            new IdleRow("mouthSmileLeft", 7, 2.9, 0.02),
            new IdleRow("mouthSmileRight", 8, 3.1, 0.02),
            new IdleRow("mouthPressLeft", 9, 2.7, 0.05),
            new IdleRow("mouthPressRight", 9, 2.7, 0.05),
            new IdleRow("browInnerUp", 10, 3.1, 0.06),
            new IdleRow("browOuterUpLeft", 11, 3.7, 0.04),
            new IdleRow("browOuterUpRight", 11, 3.7, 0.04),
            new IdleRow("browDownLeft", 12, 2.3, 0.03),
            new IdleRow("browDownRight", 12, 2.3, 0.03),
            new IdleRow("eyeSquintLeft", 13, 3.9, 0.05),
            new IdleRow("eyeSquintRight", 13, 3.9, 0.05),
        };

        /// <summary>The same of the eyes: fixations drift.</summary>
        public static readonly double[] GazeWander = { 0.31, 0.22 };
    }
}
