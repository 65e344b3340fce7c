#pragma once
#include "engine/values.h"

namespace godot {

/// [9, 3] of RGBA floats [height, 2 height], row by row from the top, whose first column looks along -z, its last quarter along x; turned by `turn`.
Value rows_of_panorama(const Value& rgba, int64_t height, const Transform3D& turn);

}  // namespace godot
