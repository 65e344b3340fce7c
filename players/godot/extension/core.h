// GaussianAvatarCore: a pack and its pose, for scripts.
#pragma once
#include "engine/classes.h"
#include "posed.h"

namespace godot {

class Core : public Instance {
public:
    static const ClassRow row;

    Core() : Instance{&row} {}
    ~Core() { drop(); }

    Value load(const Value& data, const Value& name);
    Value load_same(const Value& other);
    Value facts() const;
    Value clip_tracks(int64_t clip) const;
    Value conform(const Value& cases, const Value& vectors);
    Value commit();

    /// Null where nothing is loaded.
    AvatarInstance* instance() const { return instance_; }
    Posed* posed() const { return posed_; }
    AvatarFacts known() const;
    int32_t level = 0;  // -1: by the height in the image

private:
    Value take(SharedPack* shared);
    void drop();

    Posed* posed_ = nullptr;
    AvatarInstance* instance_ = nullptr;
};

/// Between the frame of scripts (the person's, right-handed) and that of a pack, [4, 4] row-major.
Transform3D transform_of(const double* matrix, bool left_handed);
void matrix_of(const Transform3D& transform, bool left_handed, double* into);

}  // namespace godot
