#include "use_everything.h"

#include "avatar_light.h"

#include <vector>

void use_everything(const AvatarPack* pack, const AvatarAllocator* allocator) {
    AvatarFacts facts;
    avatar_facts(pack, &facts);
    std::vector<uint8_t> content;
    for (uint32_t i = 0; i < facts.buffers; i++) {
        AvatarBuffer buffer;
        avatar_buffer(pack, i, &buffer);
        content.resize(buffer.has_content ? buffer.bytes : 0);
        avatar_buffer_content(pack, i, content.data());
    }
    AvatarInstance* instance = avatar_instance_open(pack, 0, allocator);
    AvatarPasses* lists[5];
    for (uint32_t i = 0; i < 5; i++) lists[i] = avatar_passes_open(pack, facts.levels - 1, i, allocator);
    if (avatar_instance_error(instance) == nullptr) {
        if (avatar_enable_driving(instance, 1) == AVATAR_OK) {
            AvatarFrame frame = {};
            frame.weights[17] = 0.5f;
            frame.head[1] = 0.2;
            avatar_drive(instance, &frame);
            avatar_update_pose(instance);
        }
        for (uint32_t i = 0; i < facts.clips; i++) {
            avatar_clip_pose(instance, i, 0.05);
            avatar_update_pose(instance);
        }
        AvatarCamera camera;
        avatar_camera_orbit(&camera, facts.whole_target, 1, 0.1, 0.1, 0.8, 320, 200);
        AvatarLight light = {};
        light.count = light.shadow = light.lights[0].point = 1;
        light.lights[0].place[2] = 2;
        avatar_set_light(instance, &light);
        avatar_update_camera(instance, &camera);
        for (AvatarPasses* list : lists) {
            avatar_passes_set(list, instance);
            avatar_passes_keep_lasting(list);
        }
    }
    for (AvatarPasses* list : lists) avatar_passes_close(list);
    avatar_instance_close(instance);
}
