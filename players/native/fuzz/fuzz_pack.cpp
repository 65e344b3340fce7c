// libFuzzer's target over the loader and all that plays a sound pack. An input is a whole pack, or an inflated body: the
// loader reads both by the same function, so that no checksum stands in the fuzzer's way.
#include <cstdlib>

#include "../src/c_interface/play_handles.h"

namespace {

constexpr size_t most_memory = size_t{256} << 20;  // bytes that an input may take
constexpr size_t stated_file = size_t{1} << 20;    // bytes of the file from which a body is said to come

size_t taken = 0;

void* allocate(void*, size_t bytes) {
    if (bytes > most_memory - taken) return nullptr;
    taken += bytes;
    return std::malloc(bytes);
}

void release(void*, void* memory, size_t bytes) {
    taken -= bytes;
    std::free(memory);
}

const AvatarAllocator limited = {allocate, release, nullptr};

void play(AvatarPack* pack) {
    AvatarFacts facts;
    avatar_facts(pack, &facts);
    AvatarInstance* instance = avatar_instance_open(pack, 0, &limited);
    if (avatar_instance_error(instance) == nullptr) {
        AvatarFrame frame = {};
        frame.weights[17] = 0.5f;
        frame.head[1] = 0.2;
        avatar_enable_driving(instance, 1);
        avatar_drive(instance, &frame);
        avatar_update_pose(instance);
        for (uint32_t clip = 0; clip < facts.clips; clip++) {
            avatar_set_clip(instance, clip, 0.05);
            avatar_update_pose(instance);
        }
    }
    for (uint32_t list = AVATAR_MESH; list <= AVATAR_VIEW; list++) {
        AvatarPasses* passes = avatar_passes_open(pack, 0, list, &limited);
        avatar_passes_set(passes, instance);
        avatar_passes_close(passes);
    }
    avatar_instance_close(instance);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    AvatarPack* pack = avatar::open_handle<AvatarPack>(&limited);
    if (pack == nullptr) return 0;
    const bool is_file = size >= 2 && data[0] == 0x1f && data[1] == 0x8b;
    pack->unusable = is_file ? !avatar::read_pack(data, size, pack->avatar, pack->arena)
                             : !avatar::read_body(data, size, stated_file, pack->avatar, pack->arena);
    if (pack->unusable != (avatar_error(pack) != nullptr)) __builtin_trap();
    if (!pack->unusable) play(pack);
    avatar_close(pack);
    return 0;
}
