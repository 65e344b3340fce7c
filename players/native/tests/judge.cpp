// Says of packs on the standard input whether they are sound, and what they hold: tests/players/hostile compares readers.
#include <cmath>
#include <cstring>

#include "../src/c_interface/handles.h"
#include "../src/drive/arkit.h"
#include "../src/formats/crc32.h"
#include "tools.h"

using namespace avatar;

namespace {

/// The checksum of bytes one after the other.
struct Checksum {
    uint32_t sum = 0;

    void add(const void* from, size_t size) { sum = crc32(static_cast<const uint8_t*>(from), size, sum); }
    template <class T>
    void add(T value) {
        add(&value, sizeof(T));
    }
    template <class Stored, class T>
    void add_as(Span<T> values) {
        for (const T& value : values) add(static_cast<Stored>(value));
    }
    void print(const char* name) const { std::printf("\"%s\":\"%08x\",", name, sum); }
};

void print_text(const char* text) {
    std::putchar('"');
    for (; *text != 0; text++) {
        if (*text == '"' || *text == '\\') std::putchar('\\');
        std::putchar(*text);
    }
    std::putchar('"');
}

void print_base64(const float* numbers, size_t count) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const uint8_t* bytes = reinterpret_cast<const uint8_t*>(numbers);
    const size_t size = 4 * count;
    for (size_t at = 0; at < size; at += 3) {
        const size_t left = size - at;
        const unsigned held = static_cast<unsigned>(bytes[at] << 16 | (left > 1 ? bytes[at + 1] << 8 : 0) | (left > 2 ? bytes[at + 2] : 0));
        const char four[] = {digits[held >> 18], digits[held >> 12 & 63], left > 1 ? digits[held >> 6 & 63] : '=', left > 2 ? digits[held & 63] : '='};
        std::fwrite(four, 1, 4, stdout);
    }
}

Checksum buffers_of(const AvatarPack& pack) {
    Checksum made;
    Bytes words;
    for (uint32_t i = 0; i < pack.avatar.program.buffers.size; i++) {
        const Buffer& buffer = pack.avatar.program.buffers[i];
        if (buffer.sections.empty()) continue;
        words.resize(static_cast<size_t>(buffer.bytes));
        avatar_buffer_content(&pack, i, words.data());
        made.add(buffer.name.data, buffer.name.size);
        made.add(words.data(), words.size());
    }
    return made;
}

Checksum arrays_of(const Avatar& avatar) {
    Checksum made;
    const Skeleton& skeleton = avatar.skeleton;
    if (avatar.has_skeleton) {
        made.add_as<int32_t>(skeleton.parents);
        made.add_as<float>(skeleton.rest_local);
        made.add_as<float>(skeleton.inverse_bind);
        made.add_as<float>(skeleton.joint_basis);
        made.add_as<int32_t>(skeleton.corrective_joints);
        made.add_as<uint32_t>(skeleton.anchor_vertices);
        std::vector<uint32_t> corners(avatar.triangles.begin(), avatar.triangles.end());
        for (const Pass& one : avatar.program.levels[0].deform) {
            const Bound* bound = corners.empty() ? one.buffer("SurfaceStatic") : nullptr;
            if (bound == nullptr) continue;
            const Elements& of = avatar.program.buffers[bound->index].find("corners")->elements;
            for (size_t i = 0; i < of.length; i++) corners.push_back(of[i]);
        }
        const size_t count = corners.size() / 3;
        for (size_t i = 0; i < 3 * count; i++) made.add(corners[i % 3 * count + i / 3]);
    }
    made.add(avatar.preview.data, avatar.preview.size);
    return made;
}

Checksum clips_of(const Avatar& avatar) {
    Checksum made;
    for (const ClipData& clip : avatar.clips) {
        made.add(clip.name.data, clip.name.size);
        made.add(clip.fps);
        made.add(clip.frames);
        for (const Span<float>& part : {clip.expression_weights, clip.late_weights, clip.joint_delta, clip.world_from_avatar}) {
            made.add(part.data, 4 * part.size);
        }
    }
    return made;
}

/// All names that are given by the functions of a host.
void set_named(AvatarInstance* instance, const Avatar& avatar) {
    for (size_t k = 0; k < avatar.expressions.size; k++) {
        avatar_set_expression(instance, avatar.expressions[k].name.data, 0.1 * static_cast<double>(k % 7));
    }
    for (size_t l = 0; l < avatar.late_morphs.size; l++) {
        avatar_set_eyelid(instance, avatar.late_morphs[l].data, 0.1 * static_cast<double>(l % 7));
    }
    for (size_t j = 0; j < avatar.skeleton.names.size; j++) {
        const double angle = 0.05 * static_cast<double>(j % 5) / std::sqrt(14.0);
        avatar_set_joint(instance, avatar.skeleton.names[j].data, angle, 2 * angle, 3 * angle);
    }
}

void set_driven(AvatarInstance* instance, const Avatar& avatar) {
    AvatarFrame frame = {};
    frame.struct_size = sizeof(frame);
    for (size_t i = 0; i < avatar.driving.inputs.size; i++) {
        const int channel = shape_of(avatar.driving.inputs[i]);
        if (channel >= 0) frame.weights[channel] = static_cast<float>(0.1 * static_cast<double>(i % 9 + 1));
    }
    if (avatar.has_driving && avatar_enable_driving(instance, 0) == AVATAR_OK) avatar_drive(instance, &frame);
}

void print_pose(AvatarInstance* instance, const char* name) {
    avatar_update_pose(instance);
    uint32_t count = 0;
    const float* floats = avatar_pose_floats(instance, &count);
    std::printf("\"%s\":\"", name);
    print_base64(floats, count);
    std::printf("\"");
    avatar_reset_pose(instance);
}

void print_sound(const AvatarPack& pack, AvatarInstance* instance) {
    const Avatar& avatar = pack.avatar;
    std::printf("{\"ok\":true,");
    buffers_of(pack).print("buffers");
    arrays_of(avatar).print("arrays");
    clips_of(avatar).print("clips");
    std::printf("\"poses\":{");
    print_pose(instance, "rest");
    std::putchar(',');
    set_named(instance, avatar);
    print_pose(instance, "named");
    std::putchar(',');
    set_driven(instance, avatar);
    print_pose(instance, "driven");
    std::putchar(',');
    AvatarClip clip;
    if (avatar_clip(&pack, 0, &clip) == AVATAR_OK) avatar_clip_pose(instance, 0, 0.37 * clip.seconds);
    print_pose(instance, "clip");
    std::printf("}}\n");
}

}  // namespace

int main() {
    uint32_t size = 0;
    Bytes file;
    while (std::fread(&size, 4, 1, stdin) == 1) {
        file.resize(size);
        if (size > 0 && std::fread(file.data(), 1, size, stdin) != size) return 1;
        AvatarPack* pack = avatar_load(file.data(), size, "pack", nullptr);
        AvatarInstance* instance = avatar_instance_open(pack, 0, nullptr);
        const char* why = avatar_error(pack) != nullptr ? avatar_error(pack) : avatar_instance_error(instance);
        if (why == nullptr) {
            print_sound(*pack, instance);
        } else {
            std::printf("{\"ok\":false,\"why\":");
            print_text(why);
            std::printf("}\n");
        }
        std::fflush(stdout);
        avatar_instance_close(instance);
        avatar_close(pack);
    }
    return 0;
}
