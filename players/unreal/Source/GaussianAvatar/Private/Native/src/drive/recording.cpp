// Copy of players/native/src/drive/recording.cpp by `python -m avatar_shaders`; do not edit.
#include "recording.h"

#include <algorithm>
#include <cmath>

namespace avatar {

static constexpr double whole_rate = 8e-4;  // a rate so near to a whole number is that number: clocks of recorders drift
static constexpr double default_fps = 30;   // of a single frame

void set_channels(AvatarFrame& frame, const double* channels) {
    for (int i = 0; i < arkit_shapes; i++) frame.weights[i] = static_cast<float>(channels[i]);
    std::memcpy(frame.head, channels + arkit_shapes, sizeof(frame.head));
    std::memcpy(frame.left_eye, channels + arkit_shapes + 3, sizeof(frame.left_eye));
    std::memcpy(frame.right_eye, channels + arkit_shapes + 6, sizeof(frame.right_eye));
}

void Recording::sample(double at_seconds, AvatarFrame& frame) const {
    const double* found = std::upper_bound(times.begin(), times.end(), at_seconds);  // of a NaN the end
    const size_t after = static_cast<size_t>(found - times.begin());
    const size_t at = after == 0 || std::isnan(at_seconds) ? 0 : after - 1;
    const size_t next = at + 1 < times.size ? at + 1 : at;
    const double step = times[next] - times[at];
    double part = step > 0 ? std::fmin(std::fmax((at_seconds - times[at]) / step, 0), 1) : 0;
    if (std::isnan(at_seconds)) part = 0;
    double mixed[arkit_channels];
    const double *a = &channels[at * arkit_channels], *b = &channels[next * arkit_channels];
    for (int c = 0; c < arkit_channels; c++) mixed[c] = (1 - part) * a[c] + part * b[c];
    set_channels(frame, mixed);
}

double rate_of(Span<double> times, Arena& scratch) {
    Span<double> steps = scratch.make<double>(times.size);
    size_t count = 0;
    for (size_t i = 1; i < times.size && !steps.empty(); i++) {
        if (times[i] > times[i - 1]) steps[count++] = times[i] - times[i - 1];
    }
    if (count == 0) return default_fps;
    std::sort(steps.begin(), steps.begin() + count);
    const size_t middle = count / 2;
    const double median = count % 2 == 1 ? steps[middle] : (steps[middle - 1] + steps[middle]) / 2;
    const double rate = 1 / median, whole = std::floor(rate + 0.5);
    return whole > 0 && std::fabs(rate / whole - 1) < whole_rate ? whole : rate;
}

static int32_t i32_at(const uint8_t* b) {
    return static_cast<int32_t>(static_cast<uint32_t>(b[0]) << 24 | static_cast<uint32_t>(b[1]) << 16 |
                                static_cast<uint32_t>(b[2]) << 8 | static_cast<uint32_t>(b[3]));
}

static double f32_at(const uint8_t* bytes) {
    const int32_t bits = i32_at(bytes);
    float value;
    std::memcpy(&value, &bits, 4);
    return static_cast<double>(value);
}

/// The first byte behind a text that begins at `at`; 0 if it is not one.
static size_t behind_text(const uint8_t* packet, size_t length, size_t at) {
    constexpr int32_t most_text = 1024;  // bytes of a device id or a subject name
    if (length - at < 4) return 0;
    const int32_t size = i32_at(packet + at);
    at += 4;
    if (size < 0 || size > most_text || static_cast<size_t>(size) > length - at) return 0;
    return is_utf8(packet + at, static_cast<size_t>(size)) ? at + static_cast<size_t>(size) : 0;
}

bool read_packet(const uint8_t* packet, size_t length, AvatarFrame& into) {
    constexpr uint8_t version = 6;
    constexpr size_t frame_time = 16;  // bytes
    constexpr double most = 100;       // weights are in 0..1 and angles in -pi..pi; larger values are refused
    if (packet == nullptr || length < 1 || packet[0] != version) return false;
    size_t at = behind_text(packet, length, 1);
    at = at == 0 ? 0 : behind_text(packet, length, at);
    if (at == 0 || length - at < frame_time) return false;
    if (!std::isfinite(f32_at(packet + at + 4)) || i32_at(packet + at + 8) <= 0 || i32_at(packet + at + 12) <= 0) return false;
    at += frame_time;
    if (length - at != 1 + 4 * arkit_channels || packet[at] != arkit_channels) return false;
    at++;
    double channels[arkit_channels];
    for (size_t i = 0; i < arkit_channels; i++) {
        channels[i] = f32_at(packet + at + 4 * i);
        if (!(std::fabs(channels[i]) <= most)) return false;
    }
    set_channels(into, channels);
    return true;
}

}  // namespace avatar
