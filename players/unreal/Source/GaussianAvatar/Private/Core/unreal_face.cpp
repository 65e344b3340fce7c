#include "unreal_face.h"

namespace avatar_unreal {

bool set_channel(AvatarFrame& frame, const char* name, double value) {
    const int32_t channel = avatar_arkit_channel(name);
    if (channel < 0) return false;
    if (channel < AVATAR_ARKIT_WEIGHTS) {
        frame.weights[channel] = static_cast<float>(value);
        return true;
    }
    double* const angles[3] = {frame.head, frame.left_eye, frame.right_eye};
    const int32_t angle = channel - AVATAR_ARKIT_WEIGHTS;
    angles[angle / 3][angle % 3] = value;
    return true;
}

}  // namespace avatar_unreal
