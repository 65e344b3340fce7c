#include "arkit.h"

#include <initializer_list>

namespace avatar {

const char* const arkit_names[arkit_channels] = {
    "eyeBlinkLeft", "eyeLookDownLeft", "eyeLookInLeft", "eyeLookOutLeft", "eyeLookUpLeft", "eyeSquintLeft", "eyeWideLeft",
    "eyeBlinkRight", "eyeLookDownRight", "eyeLookInRight", "eyeLookOutRight", "eyeLookUpRight", "eyeSquintRight",
    "eyeWideRight", "jawForward", "jawRight", "jawLeft", "jawOpen", "mouthClose", "mouthFunnel", "mouthPucker",
    "mouthRight", "mouthLeft", "mouthSmileLeft", "mouthSmileRight", "mouthFrownLeft", "mouthFrownRight",
    "mouthDimpleLeft", "mouthDimpleRight", "mouthStretchLeft", "mouthStretchRight", "mouthRollLower", "mouthRollUpper",
    "mouthShrugLower", "mouthShrugUpper", "mouthPressLeft", "mouthPressRight", "mouthLowerDownLeft",
    "mouthLowerDownRight", "mouthUpperUpLeft", "mouthUpperUpRight", "browDownLeft", "browDownRight", "browInnerUp",
    "browOuterUpLeft", "browOuterUpRight", "cheekPuff", "cheekSquintLeft", "cheekSquintRight", "noseSneerLeft",
    "noseSneerRight", "tongueOut", "headYaw", "headPitch", "headRoll", "leftEyeYaw", "leftEyePitch", "leftEyeRoll",
    "rightEyeYaw", "rightEyePitch", "rightEyeRoll"};

static constexpr size_t most_plain = 64;  // letters of a spelling

static char small(char letter) { return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter + 32) : letter; }

static bool is_space(char letter) { return letter == ' ' || (letter >= '\t' && letter <= '\r'); }

Text trimmed(Text text) {
    while (text.size > 0 && is_space(text.data[0])) text = Text(text.data + 1, text.size - 1);
    while (text.size > 0 && is_space(text.data[text.size - 1])) text.size--;
    return text;
}

/// Whether a plain spelling is a name in small letters, with so many of its last letters replaced by `end`.
static bool is_spelling(Text plain, Text name, uint32_t without, Text end) {
    if (plain.size != name.size - without + end.size) return false;
    for (uint32_t i = 0; i < plain.size; i++) {
        const uint32_t kept = name.size - without;
        const char wanted = i < kept ? small(name.data[i]) : end.data[i - kept];
        if (plain.data[i] != wanted) return false;
    }
    return true;
}

static bool ends(Text name, Text end) {
    return name.size > end.size && std::memcmp(name.data + name.size - end.size, end.data, end.size) == 0;
}

/// Behind "ak_NUMBER_", "arkit_" or "bs_".
static Text without_prefix(Text name) {
    if (name.begins("ak_")) {
        uint32_t at = 3;
        while (at < name.size && name.data[at] >= '0' && name.data[at] <= '9') at++;
        const bool is_prefix = at > 3 && at < name.size && name.data[at] == '_';
        return is_prefix ? Text(name.data + at + 1, name.size - at - 1) : name;
    }
    for (const char* prefix : {"arkit_", "bs_"}) {
        const Text one = prefix;
        if (name.begins(one)) return Text(name.data + one.size, name.size - one.size);
    }
    return name;
}

int channel_of(Text name) {
    name = trimmed(name);
    for (uint32_t i = name.size; i-- > 0;) {
        if (std::strchr(".:|/", name.data[i]) == nullptr || name.data[i] == 0) continue;
        name = Text(name.data + i + 1, name.size - i - 1);
        break;
    }
    char letters[most_plain];
    if (name.size > most_plain) return -1;
    for (uint32_t i = 0; i < name.size; i++) letters[i] = small(name.data[i]);
    const Text rest = without_prefix(Text(letters, name.size));
    char squeezed[most_plain];
    uint32_t size = 0;
    for (uint32_t i = 0; i < rest.size; i++) {
        if (std::strchr("_- ", rest.data[i]) == nullptr || rest.data[i] == 0) squeezed[size++] = rest.data[i];
    }
    const Text plain(squeezed, size);
    for (int channel = 0; channel < arkit_channels; channel++) {
        const Text one = arkit_names[channel];
        if (is_spelling(plain, one, 0, "")) return channel;
        if (channel >= arkit_shapes) continue;
        if (ends(one, "Left") && is_spelling(plain, one, 4, "l")) return channel;
        if (ends(one, "Right") && is_spelling(plain, one, 5, "r")) return channel;
        if (one != "browInnerUp" && one != "cheekPuff") continue;
        for (const char* side : {"l", "r", "left", "right"}) {
            if (is_spelling(plain, one, 0, side)) return channel;
        }
    }
    return -1;
}

int shape_of(Text name) {
    for (int i = 0; i < arkit_shapes; i++) {
        if (name == arkit_names[i]) return i;
    }
    return -1;
}

}  // namespace avatar
