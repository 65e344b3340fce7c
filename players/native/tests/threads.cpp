// Two avatars of one pack, each posed on a thread of its own, under a sanitizer that sees data races. Prints whether both
// got what one thread alone gets.
#include <cstdio>
#include <thread>

#include "avatar_player.h"
#include "tools.h"

static void play(const AvatarPack* pack, const std::vector<uint8_t>* file, std::vector<float>* out) {
    AvatarInstance* avatar = avatar_instance_open(pack, 0, nullptr);
    AvatarPasses* view = avatar_passes_open(pack, 0, AVATAR_VIEW, nullptr);
    AvatarPack* own = avatar_load(file->data(), file->size(), "own.avatar", nullptr);
    avatar_enable_driving(avatar, 1);
    const double target[3] = {0, 0, 0};
    AvatarFrame frame = {};
    for (int i = 0; i < 30; i++) {
        frame.weights[17] = 0.01f * static_cast<float>(i);
        frame.head[0] = 0.01 * i;
        if (i % 3 == 0) avatar_clip_pose(avatar, 0, 0.03 * i);
        else avatar_drive(avatar, &frame);
        avatar_set_expression(avatar, "no such name", 1);
        avatar_update_pose(avatar);
        AvatarCamera camera;
        avatar_camera_orbit(&camera, target, 1, 0.01 * i, 0, 0.8, 64, 48);
        avatar_update_camera(avatar, &camera);
        avatar_passes_set(view, avatar);
        avatar_arkit_channel("jaw_open");
        avatar_shader(AVATAR_MSL, "project");
    }
    uint32_t count = 0;
    const float* made = avatar_pose_floats(avatar, &count);
    out->assign(made, made + count);
    avatar_close(own);
    avatar_passes_close(view);
    avatar_instance_close(avatar);
}

int main(int count, char** words) {
    const std::vector<uint8_t> file = read_file(count > 1 ? words[1] : "");
    AvatarPack* pack = avatar_load(file.data(), file.size(), "a.avatar", nullptr);
    if (const char* line = avatar_error(pack)) return std::printf("%s\n", line), 1;
    std::vector<float> floats[3];
    std::thread first(play, pack, &file, &floats[0]), second(play, pack, &file, &floats[1]);
    first.join();
    second.join();
    play(pack, &file, &floats[2]);
    std::printf("%zu floats, %s\n", floats[0].size(), floats[0] == floats[2] && floats[1] == floats[2] ? "equal" : "different");
    avatar_close(pack);
    return 0;
}
