#pragma once
#include "gl.h"

namespace avatar {

/// A storage buffer of zeros, or with the content of a pack's buffer (`content` 0 or more). 0: it sets the error, where
/// the device takes no such buffer or has no memory.
uint32_t make_buffer(const Gl& gl, Errors& errors, const char* name, uint64_t bytes, const AvatarPack* pack = nullptr,
                     int64_t content = -1);

}  // namespace avatar
