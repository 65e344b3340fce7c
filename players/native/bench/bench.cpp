// Prints milliseconds of CPU time of loading a pack and of posing it: the medians of several runs.
//   bench PACK RUNS POSES
#include <algorithm>
#include <cstdlib>
#include <ctime>

#include "../tests/tools.h"
#include "avatar_player.h"

static double now() {
    return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

static double median(std::vector<double>& of) {
    std::sort(of.begin(), of.end());
    return of[of.size() / 2];
}

int main(int count, char** words) {
    if (count != 4 || std::atoi(words[2]) < 1 || std::atoi(words[3]) < 1) return 2;
    const std::vector<uint8_t> file = read_file(words[1]);
    const int runs = std::atoi(words[2]), poses = std::atoi(words[3]);
    std::vector<double> load, pose;
    for (int run = 0; run < runs; run++) {
        const double begin = now();
        AvatarPack* pack = avatar_load(file.data(), file.size(), words[1], nullptr);
        load.push_back(now() - begin);
        if (avatar_error(pack) != nullptr) {
            std::fprintf(stderr, "%s\n", avatar_error(pack));
            return 1;
        }
        AvatarInstance* instance = avatar_instance_open(pack, 0, nullptr);
        AvatarFacts facts;
        avatar_facts(pack, &facts);
        const bool drives = avatar_enable_driving(instance, 0) == AVATAR_OK;
        AvatarFrame frame = {};
        const double first = now();
        for (int i = 0; i < poses; i++) {
            for (int w = 0; w < AVATAR_ARKIT_WEIGHTS; w++) frame.weights[w] = 0.01f * static_cast<float>((i + w) % 100);
            frame.head[0] = 0.001 * i;
            if (drives) avatar_drive(instance, &frame);
            avatar_update_pose(instance);
        }
        pose.push_back((now() - first) / poses);
        if (run + 1 == runs) {
            std::printf("%u joints, %u expressions, %u anchors: load %.2f ms, driving and pose %.4f ms\n", facts.joints,
                        facts.expressions, facts.anchors, median(load), median(pose));
        }
        avatar_instance_close(instance);
        avatar_close(pack);
    }
    return 0;
}
