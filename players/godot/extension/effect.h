// GaussianAvatarEffect: the compositor effect that draws the avatars of a world.
#pragma once
#include "core.h"
#include "gpu/renderer.h"

namespace godot {

class Effect : public Instance {
public:
    static const ClassRow row;

    explicit Effect(GDExtensionObjectPtr object);
    ~Effect();

    void add(const Value& core);
    void remove(const Value& core);
    void set_place(const Value& core, const Transform3D& place, bool visible);
    void set_light(const Value& core, const Value& numbers);
    Value error();
    Value statistics() const;
    Value accumulated();
    /// Frees all on the GPU, on the render thread.
    void release();

private:
    static void called(GDExtensionClassInstancePtr instance, const GDExtensionConstTypePtr* given, GDExtensionTypePtr);
    void render(GDExtensionObjectPtr data);
    void views(GDExtensionObjectPtr buffers, GDExtensionObjectPtr scene);
    Wanted* wanted_of(const Posed* posed);

    std::mutex mutex_;
    Errors errors_;
    avatar::Grown<Wanted> wanted_;
    Renderer* renderer_ = nullptr;  // the render thread's
    Statistics statistics_;
    int64_t frame_ = -1;  // the newest that was followed
};

}  // namespace godot
