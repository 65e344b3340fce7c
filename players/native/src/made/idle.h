// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.
#pragma once

namespace avatar {
namespace idle_table {

/// A channel, the number of its curve, and the curve's numbers.
struct Row {
    const char* channel;
    int row;
    double numbers[2];
};

/// Seconds of a slot with one blink or one pair: 13 a minute.
constexpr double blink_every_s = 4.5;

/// Part of a slot, from its begin, in which the blink may start: 2 to 7 s apart.
constexpr double blink_window = 0.55;

/// Seconds in which the lids fall.
constexpr double blink_close_s = 0.09;

/// Seconds of closed eyes; longer than a frame of a film at 25 frames a second, which thus shows them closed.
constexpr double blink_closed_s = 0.045;

/// Seconds in which the lids rise, fast at first.
constexpr double blink_open_s = 0.18;

/// How often a second blink follows at once.
constexpr double blink_pair_chance = 0.12;

/// Seconds from the begin of the first to that of the second.
constexpr double blink_pair_s = 0.36;

/// A blink starts with the largest gaze shift of its window if that has more degrees.
constexpr double blink_with_gaze_deg = 3.0;

/// Mean seconds of a fixation.
constexpr double fixation_every_s = 1.7;

/// Part of that in which the gaze may shift: fixations of 0.4 to 3 s.
constexpr double fixation_window = 0.75;

/// How many fixations are on the viewer.
constexpr double gaze_viewer_chance = 0.68;

/// How far these lie from straight ahead at most, yaw and pitch, degrees: over a face.
constexpr double gaze_viewer_deg[] = {1.1, 0.7};

/// How far the others lie at most; their yaw is at least 0.4 of it. Within 8 degrees.
constexpr double gaze_away_deg[] = {6.9, 4.0};

/// Seconds of the least gaze shift.
constexpr double saccade_s = 0.021;

/// And for each degree more.
constexpr double saccade_s_per_deg = 0.0022;

/// The head's part of a gaze shift; the eyes then turn back, so that the gaze rests.
constexpr double head_share = 0.3;

/// Seconds by which the head starts later than the eyes.
constexpr double head_delay_s = 0.04;

/// Seconds in which it turns, with least jerk.
constexpr double head_turn_s = 0.95;

/// Seconds of a breath: 14 a minute.
constexpr double breath_every_s = 4.285714285714286;

/// Part of a breath that flows in.
constexpr double breath_in = 0.4;

/// Part that flows out; the rest is a pause.
constexpr double breath_out = 0.48;

/// Breaths come this part of a breath early or late at most; knots of that drift, seconds.
constexpr double breath_drift[] = {0.3, 9.0};

/// What full lungs add: channels, degrees or weight; the jaw stays, since it parts the lips.
constexpr Row breath[] = {
    {"headPitch", 0, {0.8}}, {"noseSneerLeft", 1, {0.06}}, {"noseSneerRight", 1, {0.06}},
    {"mouthShrugLower", 2, {0.04}}, {"browInnerUp", 3, {0.02}},
};

/// Channels on random curves: seconds between knots; size in degrees to both sides, or half the greatest weight.
constexpr Row wander[] = {
    {"headYaw", 0, {5.3, 2.2}}, {"headYaw", 1, {1.6, 0.5}}, {"headPitch", 2, {4.7, 1.3}},
    {"headPitch", 3, {1.4, 0.4}}, {"headRoll", 4, {4.1, 1.9}}, {"headRoll", 5, {1.9, 0.4}},
    {"mouthSmileLeft", 6, {4.3, 0.06}}, {"mouthSmileRight", 6, {4.3, 0.06}}, {"mouthSmileLeft", 7, {2.9, 0.02}},
    {"mouthSmileRight", 8, {3.1, 0.02}}, {"mouthPressLeft", 9, {2.7, 0.05}}, {"mouthPressRight", 9, {2.7, 0.05}},
    {"browInnerUp", 10, {3.1, 0.06}}, {"browOuterUpLeft", 11, {3.7, 0.04}}, {"browOuterUpRight", 11, {3.7, 0.04}},
    {"browDownLeft", 12, {2.3, 0.03}}, {"browDownRight", 12, {2.3, 0.03}}, {"eyeSquintLeft", 13, {3.9, 0.05}},
    {"eyeSquintRight", 13, {3.9, 0.05}},
};

/// The same of the eyes: fixations drift.
constexpr double gaze_wander[] = {0.31, 0.22};

}  // namespace idle_table
}  // namespace avatar
