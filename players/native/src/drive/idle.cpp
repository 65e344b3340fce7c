#include "idle.h"

#include <algorithm>
#include <cmath>

#include "../made/idle.h"
#include "arkit.h"

namespace avatar {
namespace idle_table {

static constexpr double degree = 3.141592653589793 / 180;

// Streams of random numbers. A row of `wander` has its own, from `rows` on.
enum : uint32_t { blinks = 1, pairs, shifts, places, yaws, drift_yaws = 7, breaths = 9, rows };

/// The finaliser of MurmurHash3 (Appleby, public domain): 32 bits to 32 bits, each of them from all.
static uint32_t mixed(uint32_t bits) {
    bits = (bits ^ bits >> 16) * 0x85ebca6bu;
    bits = (bits ^ bits >> 13) * 0xc2b2ae35u;
    return bits ^ bits >> 16;
}

/// A number from 0 to below 1.
static double random(uint32_t seed, uint32_t stream, int64_t index) {
    return mixed(mixed(seed + stream * 0x9e3779b9u) ^ static_cast<uint32_t>(index)) / 4294967296.0;
}

static int64_t floor_of(double value) { return static_cast<int64_t>(std::floor(value)); }

/// A smooth random curve within -1 and 1: the cubic B-spline of random numbers, one a knot.
static double curve(double knots, uint32_t seed, uint32_t stream) {
    const int64_t knot = floor_of(knots);
    const double x = knots - static_cast<double>(knot), y = 1 - x;
    double v[4];
    for (int i = 0; i < 4; i++) v[i] = 2 * random(seed, stream, knot + i - 1) - 1;
    const double middle = (4 - 6 * x * x + 3 * x * x * x) * v[1] + (4 - 6 * y * y + 3 * y * y * y) * v[2];
    return (y * y * y * v[0] + middle + x * x * x * v[3]) / 6;
}

/// From 0 to 1 with least jerk; held beyond.
static double eased(double part) {
    const double x = std::fmin(std::fmax(part, 0), 1);
    return x * x * x * (10 + x * (6 * x - 15));
}

/// The channels of a table's rows.
template <size_t N>
struct Channels {
    int of[N];

    explicit Channels(const Row (&table)[N]) {
        for (size_t i = 0; i < N; i++) of[i] = channel_of(table[i].channel);
    }
};

static void add(AvatarFrame& frame, int at, double size, double angle, double weight) {
    if (at >= arkit_shapes) frame.head[at - arkit_shapes] += size * degree * angle;
    else frame.weights[at] = static_cast<float>(static_cast<double>(frame.weights[at]) + size * weight);
}

static void wander_about(double seconds, uint32_t seed, AvatarFrame& frame) {
    static const Channels channels(wander);
    const int* at = channels.of;
    for (const Row& one : wander) {
        const double value = curve(seconds / one.numbers[0], seed, rows + static_cast<uint32_t>(one.row));
        add(frame, *at++, one.numbers[1], value, 1 + value);
    }
}

static void breathe(double seconds, uint32_t seed, AvatarFrame& frame) {
    const double drift = breath_drift[0] * curve(seconds / breath_drift[1], seed, breaths);
    const double all = seconds / breath_every_s + drift, now = all - std::floor(all), since_in = now - breath_in;
    const double full = since_in < 0 ? eased(now / breath_in) : 1 - eased(since_in / breath_out);
    static const Channels channels(breath);
    const int* at = channels.of;
    for (const Row& one : breath) add(frame, *at++, one.numbers[0], full, full);
}

/// When the gaze starts to shift to a fixation.
static double shift(int64_t fixation, uint32_t seed) {
    return fixation_every_s * (static_cast<double>(fixation) + fixation_window * random(seed, shifts, fixation));
}

/// The number of the fixation that has begun last.
static int64_t fixation_at(double seconds, uint32_t seed) {
    const int64_t slot = floor_of(seconds / fixation_every_s);
    return seconds >= shift(slot, seed) ? slot : slot - 1;
}

/// Where a fixation looks, degrees: yaw to the subject's left (axis 0), pitch up (1).
static double target(int64_t fixation, uint32_t axis, uint32_t seed) {
    double value = 2 * random(seed, yaws + axis, fixation) - 1;
    if (random(seed, places, fixation) < gaze_viewer_chance) return gaze_viewer_deg[axis] * value;
    if (axis == 0) value = 0.6 * value + (value >= 0 ? 0.4 : -0.4);
    return gaze_away_deg[axis] * value;
}

/// How far the gaze shifts to a fixation, degrees.
static double distance(int64_t fixation, uint32_t seed) {
    const double yaw = target(fixation, 0, seed) - target(fixation - 1, 0, seed);
    const double pitch = target(fixation, 1, seed) - target(fixation - 1, 1, seed);
    return std::sqrt(yaw * yaw + pitch * pitch);
}

/// Both eyes by an angle in the head, to the subject's left (axis 0) or up (1), as channels and as weights.
static void turn_eyes(AvatarFrame& frame, int axis, double angle) {
    static const char* const ways[2][2][2] = {{{"eyeLookInLeft", "eyeLookOutRight"}, {"eyeLookOutLeft", "eyeLookInRight"}},
                                              {{"eyeLookDownLeft", "eyeLookDownRight"}, {"eyeLookUpLeft", "eyeLookUpRight"}}};
    frame.left_eye[axis] = frame.right_eye[axis] = -angle;
    const double weight = angle / radians_per_eye_weight;
    for (const char* name : ways[axis][weight > 0]) frame.weights[shape_of(name)] = static_cast<float>(std::fabs(weight));
}

/// Shifts the gaze; the head comes after, and the eyes turn back by what the head has turned.
static void look(double seconds, uint32_t seed, AvatarFrame& frame) {
    const int64_t now = fixation_at(seconds, seed);
    const double saccade = saccade_s + saccade_s_per_deg * distance(now, seed);
    const double done = eased((seconds - shift(now, seed)) / saccade);
    for (uint32_t axis = 0; axis < 2; axis++) {
        double at[4];
        for (int i = 0; i < 4; i++) at[i] = target(now - 3 + i, axis, seed);
        const double drift = gaze_wander[1] * curve(seconds / gaze_wander[0], seed, drift_yaws + axis);
        const double gaze = at[2] + done * (at[3] - at[2]) + drift;
        double head = at[0];  // the shifts before `now` - 2 are over
        for (int step = 1; step < 4; step++) {
            const double since = seconds - shift(now - 3 + step, seed) - head_delay_s;
            head += eased(since / head_turn_s) * (at[step] - at[step - 1]);
        }
        frame.head[axis] += head_share * degree * head;
        turn_eyes(frame, static_cast<int>(axis), degree * gaze - frame.head[axis]);
    }
}

/// How far a blink has closed the lids, by the seconds since its start.
static double lids(double since) {
    const double opening = since - blink_close_s - blink_closed_s;
    if (opening < 0) return eased(since / blink_close_s);
    const double left = 1 - std::fmin(opening / blink_open_s, 1);
    return left * left * left * (4 - 3 * left);
}

/// When the blink of a slot starts: with the largest gaze shift of its window, else at random.
static double blink_start(int64_t slot, uint32_t seed) {
    const double begin = blink_every_s * static_cast<double>(slot), end = begin + blink_window * blink_every_s;
    double start = begin + (end - begin) * random(seed, blinks, slot), most = blink_with_gaze_deg;
    for (int64_t at = fixation_at(begin, seed) + 1; shift(at, seed) < end; at++) {
        const double far = distance(at, seed);
        if (far > most) start = shift(at, seed);
        most = std::max(most, far);
    }
    return start;
}

/// How far the lids are closed.
static double blink(double seconds, uint32_t seed) {
    const int64_t slot = floor_of(seconds / blink_every_s);
    const double since = seconds - blink_start(slot, seed);
    const bool twice = random(seed, pairs, slot) < blink_pair_chance;
    return lids(since) + (twice ? lids(since - blink_pair_s) : 0);
}

}  // namespace idle_table

void write_idle(double seconds, uint32_t seed, AvatarFrame& frame) {
    frame = {};
    idle_table::wander_about(seconds, seed, frame);
    idle_table::breathe(seconds, seed, frame);
    idle_table::look(seconds, seed, frame);
    const float closed = static_cast<float>(idle_table::blink(seconds, seed));
    for (const char* name : {"eyeBlinkLeft", "eyeBlinkRight"}) frame.weights[shape_of(name)] = closed;
}

}  // namespace avatar
