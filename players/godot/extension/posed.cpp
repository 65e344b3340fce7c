#include "posed.h"

#include <cstdlib>
#include <cstring>

namespace godot {

Posed::Posed(SharedPack* given) : shared(given), pack(given->pack) {
    AvatarInstance* rest = avatar_instance_open(pack, 0, &counted_allocator());
    Part parts[part_count];
    parts_of(rest, parts);
    for (const Part& part : parts) size_ += part.bytes;
    bytes_ = static_cast<uint8_t*>(counted_allocator().allocate(nullptr, size_));
    uint8_t* at = bytes_;
    for (const Part& part : parts) {
        if (at == nullptr) break;
        std::memcpy(at, part.data, part.bytes);
        at += part.bytes;
    }
    avatar_instance_close(rest);
}

Posed::~Posed() {
    shared->release();
    std::free(bytes_);
}

void Posed::release() {
    if (references_.fetch_sub(1) == 1) delete this;
}

void Posed::parts_of(AvatarInstance* instance, Part* out) const {
    AvatarFacts facts;
    avatar_facts(pack, &facts);
    out[0] = {avatar_expression_weights(instance), facts.expressions * sizeof(float)};
    out[1] = {avatar_eyelid_weights(instance), facts.eyelids * sizeof(float)};
    out[2] = {avatar_joint_delta(instance), facts.joints * 16 * sizeof(double)};
    out[3] = {avatar_world_from_avatar(instance), 16 * sizeof(double)};
}

void Posed::put(AvatarInstance* from, int32_t level) {
    Part parts[part_count];
    parts_of(from, parts);
    const std::lock_guard<std::mutex> lock(mutex_);
    bool changed = level != level_;
    uint8_t* at = bytes_;
    for (const Part& part : parts) {
        if (at == nullptr) return;
        if (part.bytes > 0 && std::memcmp(at, part.data, part.bytes) != 0) {
            std::memcpy(at, part.data, part.bytes);
            changed = true;
        }
        at += part.bytes;
    }
    level_ = level;
    if (changed) version_++;
}

bool Posed::take(AvatarInstance* into, uint64_t& seen, int32_t& level) {
    Part parts[part_count];
    parts_of(into, parts);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (seen == version_ || bytes_ == nullptr) return false;
    const uint8_t* at = bytes_;
    for (const Part& part : parts) {
        if (part.bytes > 0) std::memcpy(part.data, at, part.bytes);
        at += part.bytes;
    }
    seen = version_;
    level = level_;
    return true;
}

}  // namespace godot
