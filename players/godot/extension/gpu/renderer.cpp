#include "renderer.h"

#include <cmath>
#include <cstdio>

#include "camera.h"

namespace godot {

static constexpr double farthest = 64;  // metres from the first avatar to the origin

Renderer::Renderer(GDExtensionObjectPtr device, Statistics& statistics)
    : statistics_(statistics), device_(device, false, counted_allocator()), scene_(counted_allocator(), device_), draw_(device_),
      entries_(counted_allocator(), errors_) {
    is_ready_ = draw_.make(errors_);
    if (!is_ready_) say(errors_.line());
}

Renderer::~Renderer() {
    while (entries_.size() > 0) drop(entries_.size() - 1);
}

void Renderer::say(const char* line) { std::snprintf(error_, sizeof error_, "%s", line == nullptr ? "" : line); }

void Renderer::drop(size_t index) {
    Entry& entry = entries_[index];
    if (!entry.is_broken) scene_.remove(entry.instance);
    avatar_instance_close(entry.instance);
    entry.posed->release();
    entries_[index] = entries_[entries_.size() - 1];
    entries_.set_size(entries_.size() - 1);
}

/// The entry of an avatar, made where it is new; null where there is no memory.
Renderer::Entry* Renderer::entry_of(Posed* posed) {
    for (size_t i = 0; i < entries_.size(); i++) {
        if (entries_[i].posed == posed) return &entries_[i];
    }
    AvatarInstance* instance = avatar_instance_open(posed->pack, 0, &counted_allocator());
    if (instance == nullptr || !entries_.add({posed, instance, 0, 0, 0, true, false, false, false, {}})) {
        avatar_instance_close(instance);
        return nullptr;
    }
    posed->hold();
    Entry* made = &entries_[entries_.size() - 1];
    posed->take(instance, made->seen, made->level);
    if (made->level > 0) avatar_set_level(instance, static_cast<uint32_t>(made->level));
    scene_.begin();
    made->is_broken = !scene_.add(posed->pack, instance);
    if (made->is_broken) say(scene_.errors.line());
    return made;
}

/// Goes to the level that the pose asks for, or to that of the height of the last frame.
bool Renderer::follow_level(Entry& entry) {
    uint32_t wanted = static_cast<uint32_t>(entry.level);
    const uint32_t now = avatar_instance_level(entry.instance);
    if (entry.level < 0) wanted = entry.height > 0 ? avatar_next_level(entry.posed->pack, entry.height, now) : now;
    entry.height = 0;
    return wanted != now && avatar_set_level(entry.instance, wanted) == AVATAR_OK;
}

void Renderer::move_origin(const Wanted* wanted, size_t count) {
    for (size_t i = 0; i < count; i++) {
        if (!wanted[i].visible) continue;
        for (int r = 0; r < 3; r++) {
            const double at = wanted[i].place[4 * r + 3];
            if (!(std::fabs(at - origin_[r]) <= farthest)) origin_[r] = std::isfinite(at) ? at : 0;
        }
        return;
    }
}

/// True: it stands elsewhere now, or is hidden or shown.
bool Renderer::place(Entry& entry, const Wanted& wanted) const {
    double moved[16];
    std::memcpy(moved, wanted.place, sizeof moved);
    for (int r = 0; r < 3; r++) moved[4 * r + 3] -= origin_[r];
    double* const now = avatar_place(entry.instance);
    const bool changed = std::memcmp(now, moved, sizeof moved) != 0 || entry.visible != wanted.visible;
    std::memcpy(now, moved, sizeof moved);
    entry.visible = wanted.visible;
    return changed;
}

/// True: another light falls on it now, or none.
bool Renderer::shine(Entry& entry, const Wanted& wanted) {
    AvatarLight moved = wanted.light;
    for (uint32_t i = 0; i < moved.count; i++) {
        for (int r = 0; r < 3 && moved.lights[i].point != 0; r++) moved.lights[i].place[r] -= origin_[r];
    }
    if (wanted.lit == entry.lit && (!entry.lit || std::memcmp(&moved, &entry.light, sizeof moved) == 0)) return false;
    entry.lit = wanted.lit;
    entry.light = moved;
    if (avatar_set_light(entry.instance, entry.lit ? &moved : nullptr) == AVATAR_OK) return true;
    say(avatar_instance_error(entry.instance));
    return false;
}

void Renderer::follow(const Wanted* wanted, size_t count, bool is_new) {
    bool changed = false;
    move_origin(wanted, count);
    for (size_t i = 0; i < entries_.size(); i++) entries_[i].wanted = false;
    for (size_t i = 0; i < count && is_ready_; i++) {
        Entry* entry = entry_of(wanted[i].posed);
        if (entry == nullptr) continue;
        entry->wanted = true;
        if (entry->is_broken) continue;
        changed |= entry->posed->take(entry->instance, entry->seen, entry->level);
        changed |= place(*entry, wanted[i]);
        changed |= shine(*entry, wanted[i]);
        if (is_new) changed |= follow_level(*entry);
        scene_.show(entry->instance, wanted[i].visible);
    }
    for (size_t i = entries_.size(); i > 0; i--) {
        if (!entries_[i - 1].wanted) drop(i - 1);
    }
    statistics_.frames += is_new;
    scene_.begin();
    if (changed && !scene_.pose()) say(scene_.errors.line());
}

/// The camera relative to the origin. False: it was refused, and said so.
bool Renderer::camera(Transform3D stands, const Projection& projection, Vector2i size, AvatarCamera& out) {
    double middle[3] = {0, 0, 0}, shown = 0;
    for (size_t i = 0; i < entries_.size(); i++) shown += entries_[i].visible;
    for (size_t i = 0; i < entries_.size(); i++) {
        for (int r = 0; r < 3 && entries_[i].visible; r++) middle[r] += avatar_place(entries_[i].instance)[4 * r + 3] / shown;
    }
    float* const at = &stands.origin.x;
    for (int r = 0; r < 3; r++) at[r] = static_cast<float>(static_cast<double>(at[r]) - origin_[r]);
    const char* line = camera_of(stands, projection, middle, size, out);
    if (line != nullptr) say(line);
    return line == nullptr;
}

void Renderer::view(const Transform3D& stands, const Projection& projection, Vector2i size, Rid colour, Rid depth) {
    AvatarCamera seen;
    if (!is_ready_ || !camera(stands, projection, size, seen)) return;
    bool any = false;
    for (size_t i = 0; i < entries_.size(); i++) {
        Entry& entry = entries_[i];
        if (!entry.visible || entry.is_broken) continue;
        any = true;
        if (entry.level >= 0) continue;
        const double height = avatar_height_px(entry.instance, &seen);
        if (std::isfinite(height) && height > entry.height) entry.height = height;
    }
    statistics_.views++;
    if (!any) return;
    scene_.begin();
    errors_.clear();
    if (!scene_.order(seen)) return say(scene_.errors.line());
    statistics_.sorts++;
    statistics_.splats = scene_.count();
    const bool good = draw_.quads(errors_, Rid{scene_.quads()}, scene_.count(), size, depth) &&
                      draw_.composite(errors_, colour);
    if (!good) say(errors_.line());
}

}  // namespace godot
