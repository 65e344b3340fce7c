// libFuzzer's target over the loader and all that plays a sound pack. An input is a whole pack, or an inflated body: the
// loader reads both by the same function, so that no checksum stands in the fuzzer's way.
#include <cstdlib>

#include "../src/c_interface/play_handles.h"
#include "use_everything.h"

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

const AvatarAllocator limited = {sizeof(AvatarAllocator), allocate, release, nullptr};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    AvatarPack* pack = avatar::open_handle<AvatarPack>(&limited);
    if (pack == nullptr) return 0;
    const bool is_file = size >= 2 && data[0] == 0x1f && data[1] == 0x8b;
    pack->unusable = is_file ? !avatar::read_pack(data, size, pack->avatar, pack->arena)
                             : !avatar::read_body(data, size, stated_file, pack->avatar, pack->arena);
    if (pack->unusable != (avatar_error(pack) != nullptr)) __builtin_trap();
    if (!pack->unusable) use_everything(pack, &limited);
    avatar_close(pack);
    return 0;
}
