// What tests ask the engine-free part of the Unreal plugin, as a C interface. One thread.
#include <cstring>
#include <set>

#include "unreal_face.h"
#include "unreal_frames.h"
#include "unreal_names.h"
#include "unreal_pose.h"
#include "unreal_scene.h"

using namespace avatar_unreal;

namespace {

/// What the engine's device does, told to a test: buffers are made when they are first used, or grow.
struct Told : Device {
    void (*make)(uint32_t owner, uint32_t index, uint32_t bytes, const void* content) = nullptr;
    void (*put)(uint32_t owner, uint32_t index, const void* bytes, uint32_t size) = nullptr;
    void (*go)(const char* entry, uint32_t groups, const void* block, const uint32_t* bindings, uint32_t count) = nullptr;
    void (*gone)(uint32_t owner) = nullptr;
    std::map<BufferId, uint32_t> known;

    void need(const BufferUse& use) {
        const auto found = known.find(use.id);
        if (found != known.end() && found->second >= use.bytes) return;
        known[use.id] = use.bytes;
        std::vector<uint8_t> content(use.source != nullptr ? use.bytes : 0);
        if (use.source != nullptr) avatar_buffer_content(use.source, use.id.index, content.data());
        make(use.id.owner, use.id.index, use.bytes, use.source != nullptr ? content.data() : nullptr);
    }
    void write(const BufferUse& use, const void* bytes, size_t size) override {
        need(use);
        put(use.id.owner, use.id.index, bytes, static_cast<uint32_t>(size));
    }
    void run(const AvatarDispatch& dispatch, const uint8_t* block, const std::vector<Bound>& bound) override {
        std::vector<uint32_t> numbers;
        for (const Bound& one : bound) {
            need(one.buffer);
            for (const uint32_t number : {one.binding.binding, one.buffer.id.owner, one.buffer.id.index}) numbers.push_back(number);
        }
        go(dispatch.entry, dispatch.groups, block, numbers.data(), dispatch.binding_count);
    }
    void release(uint32_t owner) override {
        for (auto at = known.begin(); at != known.end();) at = at->first.owner == owner ? known.erase(at) : std::next(at);
        gone(owner);
    }
};

struct Probe {
    Told device;
    Scene scene;
    std::map<uint32_t, Pack> packs;
    std::map<uint32_t, std::unique_ptr<PoseLayers>> layers;
    std::string line;
};

const char* text(Probe* probe, const std::string& line) {
    probe->line = line;
    return line.empty() ? nullptr : probe->line.c_str();
}

}  // namespace

extern "C" {

void place(const double* component, const double* eye, double* into) { scene_from_avatar(component, eye, into); }
void rotation(const double* xyzw, double* into) { person_rotation(xyzw, into); }
void box(const double* low, const double* high, double* a, double* b) { component_box(low, high, a, b); }
int camera(const double* view, const double* projection, int32_t width, int32_t height, AvatarCamera* into) {
    return camera_of_view(view, projection, width, height, into) ? 1 : 0;
}
int channel(AvatarFrame* frame, const char* name, double value) { return set_channel(*frame, name, value) ? 1 : 0; }

Probe* probe_open(void (*make)(uint32_t, uint32_t, uint32_t, const void*), void (*put)(uint32_t, uint32_t, const void*, uint32_t),
                  void (*go)(const char*, uint32_t, const void*, const uint32_t*, uint32_t), void (*gone)(uint32_t)) {
    Probe* made = new Probe;
    made->device.make = make;
    made->device.put = put;
    made->device.go = go;
    made->device.gone = gone;
    return made;
}
void probe_close(Probe* probe) { delete probe; }

/// Null, or the line.
const char* probe_add(Probe* probe, uint32_t id, const void* file, uint32_t bytes, const char* name) {
    std::string line;
    const Pack pack = open_pack(file, bytes, name, line);
    if (pack == nullptr) return text(probe, line);
    probe->packs[id] = pack;
    probe->layers[id].reset(new PoseLayers(pack));
    probe->scene.add(id, pack);
    return text(probe, probe->layers[id]->error());
}
void probe_remove(Probe* probe, uint32_t id) {
    probe->scene.remove(id, probe->device);
    probe->layers.erase(id);
    probe->packs.erase(id);
}
/// `kind`: 0 an expression, 1 an eyelid, 2 a joint, 3 clear.
const char* probe_set(Probe* probe, uint32_t id, int source, int kind, const char* name, const double* value) {
    PoseLayers& layers = *probe->layers[id];
    const auto from = static_cast<PoseLayers::Source>(source);
    bool well = true;
    if (kind == 0) well = layers.set_expression(from, name, *value);
    if (kind == 1) well = layers.set_eyelid(from, name, *value);
    if (kind == 2) well = layers.set_joint(from, name, value);
    if (kind == 3) layers.clear(from);
    return well ? nullptr : text(probe, layers.error());
}
/// -1: there is no such clip.
int32_t probe_clip(Probe* probe, uint32_t id, const char* name, double* seconds) { return probe->layers[id]->clip(name, *seconds); }
/// All names that a person may set or choose, with a line break after each.
const char* probe_names(Probe* probe, uint32_t id) {
    const Names found = names_of(probe->packs[id].get());
    probe->line.clear();
    for (const auto* list : {&found.expressions, &found.eyelids, &found.joints, &found.clips}) {
        for (const std::string& name : *list) probe->line += name + "\n";
    }
    return probe->line.c_str();
}
/// The newest line of the layers, if it was not told before.
const char* probe_news(Probe* probe, uint32_t id) { return probe->layers[id]->news(); }
const char* probe_mix(Probe* probe, uint32_t id, int32_t clip, double seconds, const AvatarFrame* face) {
    return probe->layers[id]->mix(clip, seconds, face) ? nullptr : text(probe, probe->layers[id]->error());
}
/// `part`: 0 expressions, 1 eyelids, 2 joints, 3 root. Returns how many; `into` may be null.
uint32_t probe_pose(Probe* probe, uint32_t id, int part, double* into) {
    const PoseValues& pose = probe->layers[id]->pose();
    std::vector<double> all;
    if (part == 0) all.assign(pose.expressions.begin(), pose.expressions.end());
    if (part == 1) all.assign(pose.eyelids.begin(), pose.eyelids.end());
    if (part == 2) all = pose.joint_delta;
    if (part == 3) all = pose.world_from_avatar;
    if (into != nullptr) std::copy(all.begin(), all.end(), into);
    return static_cast<uint32_t>(all.size());
}
void probe_send(Probe* probe, uint32_t id, const double* component, int shown) {
    probe->scene.set(id, PoseValues(probe->layers[id]->pose()), component, shown != 0);
}
/// Instances to draw; the quads' buffer in `into` (owner, index).
uint32_t probe_draw(Probe* probe, const double* view, const double* projection, const double* eye, int32_t width, int32_t height,
                    uint32_t frame, uint32_t* into) {
    const Drawn drawn = probe->scene.draw({view, projection, eye, width, height}, frame, probe->device);
    into[0] = drawn.quads.id.owner;
    into[1] = drawn.quads.id.index;
    return drawn.instances;
}
const char* probe_error(Probe* probe) { return text(probe, probe->scene.error()); }

}  // extern "C"
