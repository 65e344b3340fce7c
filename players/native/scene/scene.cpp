#include "scene.h"

namespace avatar {

/// An object of the scene's memory; null with an error.
template <class T, class... Given>
static T* make_object(HandleBase& of, Given&&... given) {
    void* memory = of.allocator.allocate(of.allocator.user, sizeof(T));
    if (memory == nullptr) of.errors.set_memory();
    return memory == nullptr ? nullptr : new (memory) T(static_cast<Given&&>(given)...);
}

template <class T>
static void free_object(HandleBase& of, T* object) {
    if (object == nullptr) return;
    object->~T();
    of.allocator.release(of.allocator.user, object, sizeof(T));
}

Scene::~Scene() {
    release();
    while (first_ != nullptr) remove(first_->instance);
}

void Scene::release() {
    forget_order();
    for (Resident* one = first_; one != nullptr; one = one->next) one->release();
    for (SharedBuffers* one = packs_; one != nullptr; one = one->next) one->release(device_);
}

void Scene::begin() {
    errors.clear();
    errors.set_owner("");
}

Resident** Scene::place_of(const AvatarInstance* instance) {
    Resident** place = &first_;
    while (*place != nullptr && (*place)->instance != instance) place = &(*place)->next;
    return place;
}

bool Scene::add(const AvatarPack* pack, AvatarInstance* instance) {
    Resident** place = place_of(instance);
    const char* line = avatar_error(pack);
    if (line == nullptr) line = instance == nullptr || *place != nullptr ? nullptr : avatar_instance_error(instance);
    if (line != nullptr || instance == nullptr || *place != nullptr) {
        errors.set("", "%s", line != nullptr ? line : instance == nullptr ? "no instance is given" : "this instance was added before");
        return false;
    }
    if (&instance->pack != pack) {
        errors.set("", "the instance is one of another pack");
        return false;
    }
    SharedBuffers* shared = shared_of(pack);
    if (shared == nullptr) return false;
    *place = uploaded(shared, instance);
    drop_unused(shared);
    forget_order();
    return *place != nullptr;
}

SharedBuffers* Scene::shared_of(const AvatarPack* pack) {
    for (SharedBuffers* one = packs_; one != nullptr; one = one->next) {
        if (one->pack == pack) return one;
    }
    SharedBuffers* made = make_object<SharedBuffers>(*this, context(), pack);
    if (made == nullptr) return nullptr;
    made->next = packs_;
    packs_ = made;
    return made;
}

/// A resident of the list's end; null with an error.
Resident* Scene::uploaded(SharedBuffers* shared, AvatarInstance* instance) {
    AvatarFacts facts;
    avatar_facts(shared->pack, &facts);
    errors.set_owner(facts.name);
    Resident* made = errors.any() ? nullptr : make_object<Resident>(*this, context(), shared, instance);
    if (made == nullptr) return nullptr;
    shared->users++;
    if (made->make()) return made;
    drop(made);
    return nullptr;
}

bool Scene::remove(const AvatarInstance* instance) {
    Resident** place = place_of(instance);
    Resident* found = *place;
    if (found == nullptr) {
        errors.set("", "this instance was not added");
        return false;
    }
    *place = found->next;
    SharedBuffers* shared = found->shared;
    drop(found);
    drop_unused(shared);
    forget_order();
    return true;
}

bool Scene::show(const AvatarInstance* instance, bool shown) {
    Resident* found = *place_of(instance);
    if (found == nullptr) {
        errors.set("", "this instance was not added");
        return false;
    }
    if (found->shown != shown) forget_order();
    found->shown = shown;
    return true;
}

void Scene::drop(Resident* resident) {
    resident->shared->users--;
    free_object(*this, resident);
}

/// Frees the buffers of a pack without instances.
void Scene::drop_unused(SharedBuffers* shared) {
    if (shared->users > 0) return;
    SharedBuffers** place = &packs_;
    while (*place != shared) place = &(*place)->next;
    *place = shared->next;
    shared->release(device_);
    free_object(*this, shared);
}

void Scene::forget_order() {
    free_object(*this, sorted_);
    sorted_ = nullptr;
}

/// Puts a new resident in the place of one: of another level, or in another context. On an error the old one stays.
bool Scene::upload_again(Resident** place) {
    Resident* old = *place;
    Resident* made = uploaded(old->shared, old->instance);
    if (made == nullptr) return false;
    made->shown = old->shown;
    made->next = old->next;
    *place = made;
    drop(old);
    forget_order();
    return true;
}

bool Scene::follow_levels() {
    for (Resident** place = &first_; *place != nullptr; place = &(*place)->next) {
        const bool same = avatar_instance_level((*place)->instance) == (*place)->level;
        if (!same && !upload_again(place)) return false;
    }
    return true;
}

bool Scene::pose() {
    if (!follow_levels()) return false;
    for (Resident* one = first_; one != nullptr; one = one->next) {
        if (one->shown && !one->pose(clock)) return false;
    }
    return true;
}

/// Makes the order of what is shown, where there is none.
bool Scene::sort() {
    if (sorted_ != nullptr) return true;
    sorted_ = make_object<Sorted>(*this, context());
    if (sorted_ != nullptr && sorted_->make(first_)) return true;
    forget_order();
    return false;
}

bool Scene::order(const AvatarCamera& camera) {
    if (!follow_levels() || !sort()) return false;
    bool changed = !sorted_->ran();
    for (Resident* one = first_; one != nullptr; one = one->next) {
        if (one->shown && !one->view(camera, clock, changed)) return false;
    }
    if (changed) sorted_->run(clock);
    return true;
}

bool Scene::restore() {
    for (Resident** place = &first_; *place != nullptr; place = &(*place)->next) {
        if (!upload_again(place)) return false;
    }
    return true;
}

}  // namespace avatar
