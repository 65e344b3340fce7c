#include "unreal_scene.h"

#include <algorithm>

#include "unreal_frames.h"
#include "unreal_passes.h"

namespace avatar_unreal {

/// An avatar, at the level that it shows.
struct Scene::Member {
    Member(uint32_t number, const Pack& shared)
        : id(number), pack(shared), instance(avatar_instance_open(shared.get(), 0, nullptr)),
          mesh(shared, number, 0, AVATAR_MESH) {
        avatar_facts(pack.get(), &facts);
        const int32_t index = avatar_buffer_index(pack.get(), "Pose");
        if (index >= 0) pose_buffer = pack_buffer(pack.get(), id, static_cast<uint32_t>(index));
    }
    ~Member() { avatar_instance_close(instance); }
    Member(const Member&) = delete;
    Member& operator=(const Member&) = delete;

    uint32_t id;
    Pack pack;
    AvatarInstance* instance;
    AvatarFacts facts = {};
    PassList mesh;
    std::unique_ptr<PassList> deform, view;  // of `level`
    uint32_t level = 0;
    uint32_t chosen = UINT32_MAX;  // level by the height; none yet
    BufferUse pose_buffer = {};
    double unreal_from_component[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    double height = 0;  // pixels, the largest of this frame
    bool shown = false;
    bool posed = false;   // the pose was computed since it was set
    bool written = false; // buffer Pose holds it
    bool ran = false;     // all of `deform` has run for the pose
    bool lasting = false; // and its lasting part was kept
};

/// The sort of a set of avatars, each at a level.
struct Scene::Sorted {
    ~Sorted() { avatar_sort_close(sort); }

    std::vector<std::pair<uint32_t, uint32_t>> key;  // id, level
    AvatarSort* sort = nullptr;
    std::unique_ptr<PassList> passes;
};

Scene::Scene() = default;
Scene::~Scene() = default;

void Scene::add(uint32_t id, const Pack& pack) { members[id].reset(new Member(id, pack)); }

void Scene::remove(uint32_t id, Device& device) {
    sort.reset();
    members.erase(id);
    device.release(id);
}

void Scene::set(uint32_t id, PoseValues&& pose, const double* unreal_from_component, bool shown) {
    const auto found = members.find(id);
    if (found == members.end()) return;
    Member& member = *found->second;
    std::copy(unreal_from_component, unreal_from_component + 16, member.unreal_from_component);
    member.shown = shown;
    if (!shown || avatar_instance_error(member.instance) != nullptr) return;
    pose.give(member.instance);
    member.posed = false;
}

void Scene::begin_frame(uint64_t frame) {
    if (frame == newest) return;
    newest = frame;
    for (auto& [id, member] : members) {
        const bool known = member->deform != nullptr;
        if (known) member->chosen = avatar_next_level(member->pack.get(), member->height, member->chosen);
        // The first picture comes at the coarsest level: it is the cheapest, and stands for one frame.
        const uint32_t wanted = known ? member->chosen : member->facts.levels - 1;
        member->height = 0;
        if (known && wanted == member->level) continue;
        member->level = wanted;
        member->deform.reset(new PassList(member->pack, id, wanted, AVATAR_DEFORM));
        member->view.reset(new PassList(member->pack, id, wanted, AVATAR_VIEW));
        member->ran = member->lasting = false;
        if (avatar_set_level(member->instance, wanted) != AVATAR_OK) line = avatar_instance_error(member->instance);
    }
}

bool Scene::deform(Member& member, Device& device) {
    const char* said = member.deform->error() != nullptr ? member.deform->error() : member.view->error();
    said = member.mesh.error() != nullptr ? member.mesh.error() : said;
    if (!member.posed) {
        member.posed = avatar_update_pose(member.instance) == AVATAR_OK;
        if (!member.posed) said = avatar_instance_error(member.instance);
        member.written = member.ran = false;
    }
    if (said != nullptr) {
        line = said;
        return false;
    }
    uint32_t count = 0;
    const float* floats = avatar_pose_floats(member.instance, &count);
    if (!member.written) {
        if (count > 0) device.write(member.pose_buffer, floats, sizeof(float) * count);
        member.mesh.set(member.instance);
        member.mesh.run(device);
        member.written = true;
    }
    if (!member.ran) {
        member.deform->set(member.instance);
        member.deform->run(device);
        if (!member.lasting) member.deform->keep_lasting();
        member.ran = member.lasting = true;
    }
    return true;
}

void Scene::project(Member& member, const AvatarCamera& camera, Device& device) {
    avatar_update_camera(member.instance, &camera);
    member.view->set(member.instance);
    member.view->run(device);
}

Scene::Sorted* Scene::sorted() {
    std::vector<std::pair<uint32_t, uint32_t>> key;
    for (auto& [id, member] : members) {
        if (member->shown) key.emplace_back(id, member->level);
    }
    if (sort != nullptr && sort->key == key) return sort.get();
    sort.reset(new Sorted);
    sort->key = key;
    std::map<std::string, BufferUse> buffers;
    std::vector<std::pair<std::string, uint32_t>> counts;
    for (const auto& [id, level] : key) {
        const AvatarPack* pack = members[id]->pack.get();
        AvatarChunk chunk = {};
        for (uint32_t i = 0; avatar_chunk(pack, level, i, &chunk) == AVATAR_OK; ++i) {
            const std::string name = std::to_string(id) + "/" + std::to_string(i);
            buffers[name] = pack_buffer(pack, id, chunk.projected);
            counts.emplace_back(name, chunk.count);
        }
    }
    std::vector<AvatarSceneChunk> chunks;
    for (const auto& [name, count] : counts) chunks.push_back({sizeof(AvatarSceneChunk), name.c_str(), count});
    sort->sort = avatar_sort_open(chunks.data(), static_cast<uint32_t>(chunks.size()), nullptr);
    const char* said = avatar_sort_error(sort->sort);
    if (said != nullptr) {
        line = said;
        return nullptr;
    }
    sort->passes.reset(new PassList(sort->sort, buffers));
    return sort.get();
}

Drawn Scene::draw(const View& view, uint64_t frame, Device& device) {
    Drawn drawn;
    AvatarCamera camera;
    begin_frame(frame);
    if (!camera_of_view(view.view_rotation, view.projection, view.width, view.height, &camera)) return drawn;
    for (auto& [id, member] : members) {
        if (!member->shown) continue;
        double* place = avatar_place(member->instance);
        if (place == nullptr || !deform(*member, device)) {
            member->shown = false;  // it is told once, until its next pose
            continue;
        }
        scene_from_avatar(member->unreal_from_component, view.eye, place);
        member->height = std::max(member->height, avatar_height_px(member->instance, &camera));
        project(*member, camera, device);
    }
    Sorted* now = sorted();
    if (now == nullptr || now->passes == nullptr || avatar_sort_count(now->sort) == 0) return drawn;
    now->passes->run(device);
    for (uint32_t i = 0; drawn.instances == 0; ++i) {
        AvatarSceneBuffer buffer = {};
        if (avatar_sort_buffer(now->sort, i, &buffer) != AVATAR_OK) return drawn;
        if (std::string(buffer.name) != "Quads") continue;
        drawn.quads = sort_buffer(now->sort, i);
        drawn.instances = avatar_sort_count(now->sort);
    }
    return drawn;
}

}  // namespace avatar_unreal
